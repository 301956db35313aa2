"""The silicone beam in the engine: let go from straight, or from where a take finds it later."""

from dataclasses import dataclass

import numpy as np

from surgisim.mpm.setup import prepare
from surgisim.recordings.recording import Recording
from surgisim.verification.silicone_take import tip

ELASTIC = "corotated"
TERMS = (ELASTIC, "newtonian")
END = np.array([[0.015, 0.015, 0.0]])
"""Middle of the free end [m]. The markers around it rise and fall with it, and being further out than the body they
would shift the grid that is laid around what is carried."""


@dataclass(frozen=True)
class Swing:
    """One run of the beam."""

    y: np.ndarray
    """Height of the free end above where it settles [m], (T,)."""
    drop: float
    """From the straight beam to where it settles [m]."""
    settled: np.ndarray
    """Nodal displacement of the settled beam [m], (A, 3)."""
    per_frame: int
    """Steps between two frames."""


def swing(
    recording: Recording,
    *,
    E: float,
    nu: float,
    eta: float,
    spacing: float,
    seconds: float,
    begin: tuple[float, float, np.ndarray, float] | None = None,
    held_nu: float | None = None,
) -> Swing:
    """Run the recording's beam on a grid of `spacing` [m].

    begin: height above rest [m], speed upwards [m/s], and the settled shape (A, 3) with its drop [m], of which the
    first state is a multiple; the straight beam at rest where None. held_nu: the held end is sprung as for this nu,
    instead of `nu`.
    """
    prepared = prepare(
        recording.body(spacing),
        TERMS,
        density=recording.density,
        gravity=recording.gravity,
        carried=END,
    )
    values = {ELASTIC: {"E": E, "nu": nu}, "newtonian": {"eta": eta}}
    frames = round(seconds * recording.fps) + 1
    held = values if held_nu is None else values | {ELASTIC: {"E": E, "nu": held_nu}}
    per_frame = max(prepared.per_frame(v, recording.fps) for v in (values, held))
    drive = prepared.drive(recording.motion, held, fps=recording.fps, per_frame=per_frame, frames=frames)
    if begin is None:
        state = None
    else:
        height, speed, shape, drop = begin
        state = (shape * (1 - height / drop), -shape * speed / drop)
    run = prepared.simulator.run(prepared.theta(values), drive, begin=state)
    carry = prepared.simulator.carry(END)
    height = tip(np.stack([carry @ u for u in run.u.astype(float)], 1))
    if begin is None:
        last = _whole_swings(height)
        settled, drop = run.u[last:].astype(float).mean(0), -float(height[last:].mean())
    else:
        settled, drop = begin[2], begin[3]
    return Swing(height + drop, drop, settled, per_frame)


def _whole_swings(height: np.ndarray) -> int:
    """Where the last two whole swings begin: a mean over them is where the beam settles."""
    about = height[len(height) // 2 :].mean()
    upward = np.flatnonzero((height[:-1] < about) & (height[1:] >= about))
    return int(upward[-3])
