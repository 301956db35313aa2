"""Active contraction: tissue that pulls by itself, once or again and again, everywhere at once or as a wave.

    sigma = tension (w(t) - w(0)) Fa (x) Fa / J                       [Pa]
    w(t) = r(t) sin^2(pi phase / duty) while phase < duty, else 0;   phase = (t - onset) / period, modulo 1
    r(t) = (1 + tanh((t - begin) / RISE)) / 2

a is the direction of the pulling cells at rest (by yaw and pitch, see physics/heading.py). Each contraction lasts
`duty` of a `period` [s]; a period longer than the clip makes it a single one. An onset and a `begin` before 0 find
the tissue in the middle of its rhythm: what the first frame holds already is in equilibrium there, hence - w(0).
Where the rhythm sets in later, `begin` says when: tissue that is slack in the first frame cannot push, as - w(0)
would. A wave reaches a point x of the body later by slowness (a . (x - middle)) [s]. It puts energy in; with the
clock stopped it stores energy as a spring does. Once differentiable in time and in every parameter (w'' jumps where a
contraction begins and ends).
Guccione and McCulloch, Mechanics of active contraction in cardiac muscle: part I, J. Biomech. Eng. 115 (1993), for
the active stress along the fibre that adds to the passive one; the time course is ours.
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term
from surgisim.physics.heading import heading

RISE = 0.08
"""How fast a rhythm sets in [s]."""


@wp.func
def wave(t: Any, theta: Any):
    turns = (t - theta[1]) / theta[2]
    phase = turns - wp.floor(turns)
    s = wp.sin(theta.dtype(wp.pi) * wp.min(phase / theta[3], theta.dtype(1.0)))
    risen = theta.dtype(0.5) * (theta.dtype(1.0) + wp.tanh((t - theta[7]) / theta.dtype(RISE)))
    return wp.where(turns > theta.dtype(0.0), risen * s * s, theta.dtype(0.0))


@wp.func
def stress(F: Any, D: Any, R: Any, q: Any, theta: Any, t: Any):
    Fa = F * wp.vector(theta[4], theta[5], theta[6], dtype=F.dtype)
    pull = theta[0] * (wave(t, theta) - wave(t - t, theta))
    return (pull / wp.determinant(F)) * wp.outer(Fa, Fa)


def twin_wave(t, onset, period, duty, begin):
    turns = (t - onset) / period
    share = np.clip((turns % 1) / duty, 0, 1)
    return 0.5 * (1 + np.tanh((t - begin) / RISE)) * np.sin(np.pi * share) ** 2 * (turns > 0)


def twin(F, D, q, t, tension, onset, period, duty, x, y, z, begin):
    Fa = F @ np.array([x, y, z])
    pull = tension * (twin_wave(t, onset, period, duty, begin) - twin_wave(0.0, onset, period, duty, begin))
    return pull * Fa[..., :, None] * Fa[..., None, :] / np.linalg.det(F)[..., None, None]


def columns(tension, onset, period, duty, slowness, yaw, pitch, begin):
    x, y, z = heading(yaw, pitch)
    rhythm = {"tension": tension, "onset": onset, "period": period, "duty": duty}
    return {**rhythm, "x": x, "y": y, "z": z, "begin": begin}


def spread(rest, onset, slowness, yaw, pitch, **others):
    """The onset at every particle [s], (P,)."""
    return {"onset": onset + slowness * (rest - rest.mean(0)) @ np.array(heading(yaw, pitch))}


TERM = Term(
    stress=stress,
    twin=twin,
    wave_modulus=lambda tension, **others: tension,
    columns=columns,
    spread=spread,
    params={
        "tension": Param("Pa", low=1e0, high=1e4, default=2e2, off=0.0),
        "onset": Param("s", low=-1e1, high=1e1, default=0.2, logarithmic=False),
        "period": Param("s", low=0.2, high=6e1, default=4.0),
        "duty": Param("1", low=0.05, high=1.0, default=0.5, logarithmic=False),
        "slowness": Param("s/m", low=-1e3, high=1e3, default=0.0, logarithmic=False),
        "yaw": Param("rad", low=-np.pi, high=np.pi, default=np.pi / 2, logarithmic=False),
        "pitch": Param("rad", low=-np.pi, high=np.pi, default=0.0, logarithmic=False),
        "begin": Param("s", low=-1.0, high=6e1, default=-1.0, logarithmic=False),
    },
)
