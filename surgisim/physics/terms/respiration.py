"""Breathing: the base that holds the tissue moves to and fro.

    d(t) = a (sin(2 pi t / T + p) - sin p + b (sin(4 pi t / T + p2) - sin p2)) n             [m]

a amplitude [m], T period [s], p and p2 phases of the two harmonics [rad], b the share of the second, n
direction by yaw and pitch (physics/heading.py). d(0) = 0: the first frame is where positions are counted from.
The tissue itself starts at rest, though a breathing patient's does not: its first quarter of a second shows a start
that the recording lacks, unless the run begins from a state that moves with the base.
Lujan, Larsen, Balter and Ten Haken, A method for incorporating organ motion due to breathing into 3D dose
calculations, Medical Physics 26 (1999), equation 1, whose even powers of a cosine are such sums of harmonics.
"""

from dataclasses import replace

import numpy as np

from surgisim.physics.catalogue import Param, Term
from surgisim.physics.heading import PITCH, YAW, heading


def drive(path, amplitude, period, phase, second, second_phase, yaw, pitch):
    angle = 2 * np.pi * np.arange(path.steps + 1) * path.step / period
    wave = np.sin(angle + phase) - np.sin(phase)
    wave = wave + second * (np.sin(2 * angle + second_phase) - np.sin(second_phase))
    moved = path.path.copy()
    moved[0] += amplitude * wave[:, None] * np.array(heading(yaw, pitch))
    return replace(path, path=moved)


TERM = Term(
    drive=drive,
    place="everywhere",
    params={
        "amplitude": Param("m", low=1e-4, high=0.02, default=0.002, off=0.0),
        "period": Param("s", low=1.5, high=10.0, default=4.0),
        "phase": Param("rad", low=-np.pi, high=np.pi, default=0.0, logarithmic=False),
        "second": Param("1", low=0.0, high=1.0, default=0.2, logarithmic=False),
        "second_phase": Param("rad", low=-np.pi, high=np.pi, default=0.0, logarithmic=False),
        "yaw": Param("rad", *YAW, default=0.0, logarithmic=False),
        "pitch": Param("rad", *PITCH, default=0.0, logarithmic=False),
    },
)
