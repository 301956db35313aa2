"""What points do under a push at one place with a free course in time: what laws of force at a place share."""

from collections.abc import Iterator

import numpy as np

from surgisim.diagnosis import answers
from surgisim.diagnosis.answers import Answers
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import angles, hats, knots, scale
from surgisim.diagnosis.hypothesis import RISE, Hypothesis
from surgisim.diagnosis.law import NEVER
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.scopes import beside, within
from surgisim.physics.place import Place

BLOB = 0.0032
"""Extent of a push or a band that is tried [m], for a body of 36 mm; it follows the body's size."""
KNOT = RISE / 2
"""Time between the knots of a load's course [s]. With longer ones it comes and goes more slowly than a load does, which
a sure recording tells from it."""
SHIFTS = np.array([-0.08, -0.04, 0.0, 0.04, 0.08])
"""By which moments are moved when a hypothesis is sharpened [s], times the step."""


def places(look: Look) -> Iterator[tuple[str, Place]]:
    """Where pushes are tried, and what the part is called."""
    for center in look.centers():
        x, y, z = 1e3 * center
        yield f"pushes near ({x:.0f}, {y:.0f}, {z:.0f}) mm", Place(tuple(center), BLOB * scale(look.clip))


def around(look: Look, h: Hypothesis, step: float) -> Iterator[Place]:
    """Beside where a hypothesis acts, as wide; then there, narrower and wider."""
    for center in within(look, beside(look, h, step), h.place.extent):
        yield Place(tuple(center), h.place.extent)
    for share in (0.7, 1.4):
        yield Place(h.place.center, share * h.place.extent)


def times(clip: Clip) -> np.ndarray:
    """The knots of a load's course [s], (B,)."""
    return knots(clip, KNOT)


def weight(look: Look, place: Place) -> np.ndarray:
    """A push's share of every particle that is free [1/m^3], (P,)."""
    mine = place.weight(look.rest) * ~look.clip.body.held
    return mine / (mine * look.base.prepared.simulator.volume_p).sum()


def columns(look: Look, place: Place) -> Answers:
    """By one newton along x, y and z, at one knot after the other [m/N], (3 B, K, T, 3)."""
    return look.once("push", place, lambda: of_force(look, weight(look, place)))


def of_force(look: Look, each: np.ndarray) -> Answers:
    """The same by a force per volume [N/m^3], (P,), along x, y and z."""
    return of_load(look, look.base.tangent.of_push(each[None, :, None] * np.eye(3)[:, None]))


def of_load(look: Look, loads: np.ndarray) -> Answers:
    """The same by three nodal forces [N], (3, 3 A)."""
    near = look.base.tangent
    states = near.at_states(np.broadcast_to(loads, (len(near.frames), *loads.shape)))
    return answers.each(states.swapaxes(0, 1), near.share, hats(times(look.clip), look.clip))


def push(force: np.ndarray, onset: float, end: float | None) -> dict[str, float]:
    """Numbers of a force [N], (3,), that has half risen RISE / 2 after its onset; end None: it stays."""
    yaw, pitch = angles(force)
    stops = NEVER if end is None else end - RISE / 2
    return {
        "force": float(np.linalg.norm(force)), "yaw": yaw, "pitch": pitch, "onset": float(onset + RISE / 2),
        "end": float(stops),
    }  # fmt: skip


def down(clip: Clip) -> np.ndarray:
    """Where a weight pulls, (3,): along gravity, into the base where none is given."""
    gravity = clip.recording.gravity
    return -clip.normal if gravity is None or not any(gravity) else np.array(gravity) / np.linalg.norm(gravity)
