"""What the silicone beam's cases share: its end as tracked points, and its swings with any laws.

Markers sit 6 mm off the beam, so that they move with its end's turning too. The end is taken as rigid: the motion that
carries the three tip markers carries points of the body, which are what is tracked.
"""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from surgisim.mpm.setup import prepare
from surgisim.physics.place import Place
from surgisim.recordings.recording import Recording, no_grips
from surgisim.verification.ringing import Ringing
from surgisim.verification.silicone_beam import above_rest, read
from surgisim.verification.silicone_run import END
from surgisim.verification.silicone_take import FPS, PLACES, SIGMA, take, tip

POINTS = 1e-3 * np.array([[3, 3, 1], [27, 3, 1], [3, 27, 1], [27, 27, 1], [15, 15, 1], [15, 15, 9]])
"""Points of the end that are tracked [m]."""
FITTED, WHOLE = 1.6, 2.4
"""Frames that are fitted, and all that are kept, after the release [s]."""


def carried(path: Path, name: str = "take") -> Recording:
    """The take with points of the beam's end in place of the markers around it."""
    seen = take(path)
    markers = seen.points.astype(float)
    frames = min(round(WHOLE * FPS), markers.shape[1])
    rest = markers[:, 0].mean(0)
    points = np.empty((len(POINTS), frames, 3))
    # Where the first frame's markers say that these points are: the makers' places are off by up to a millimetre. Only
    # displacements are taken from there, so that their directions stay those of the beam's axes.
    first, _ = Rotation.align_vectors(PLACES[:3] - PLACES[:3].mean(0), markers[:, 0] - rest)
    own = first.inv().apply(POINTS - PLACES[:3].mean(0)) + rest
    for t in range(frames):
        middle = markers[:, t].mean(0)
        turn, _ = Rotation.align_vectors(markers[:, t] - middle, markers[:, 0] - rest)
        points[:, t] = POINTS + turn.apply(own - rest) + middle - own
    return Recording(
        name=name,
        fps=seen.fps,
        mesh=seen.mesh,
        boxes=seen.boxes,
        points=points.astype(np.float32),
        visible=np.ones(points.shape[:2], bool),
        sigma=np.full(len(POINTS), SIGMA),
        motion=no_grips(frames),
        density=seen.density,
        gravity=seen.gravity,
        starts="released",
        place=POINTS,
        split={"fit": (0, round(FITTED * FPS)), "held_out": (round(FITTED * FPS), frames)},
    )


def swings(path: Path, frequency: float) -> Ringing:
    """Frequency and decay of a take's free end."""
    return read(above_rest(take(path)), frequency)


def simulated(path: Path, physics: dict[str, Any], frequency: float) -> Ringing:
    """The same of a simulation with these laws and numbers, let go from straight."""
    recording = take(path)
    places = {
        name: Place(np.array(p["center"]), p["extent"], None if p.get("normal") is None else np.array(p["normal"]))
        for name, p in physics.get("places", {}).items()
    }
    prepared = prepare(
        recording.body(physics["grid"]["spacing"]),
        tuple(physics["terms"]),
        density=recording.density,
        gravity=recording.gravity,
        carried=END,
        places=places,
    )
    values = {n: {k: float(v["value"]) for k, v in told.items()} for n, told in physics["terms"].items()}
    frames = round(1.8 * FPS) + 1
    per_frame = prepared.per_frame(values, FPS)
    drive = prepared.drive(recording.motion, values, fps=FPS, per_frame=per_frame, frames=frames)
    run = prepared.simulator.run(prepared.theta(values), drive)
    carry = prepared.simulator.carry(END)
    y = tip(np.stack([carry @ u for u in run.u.astype(float)], 1))
    return read(y - y[-50:].mean(), frequency)
