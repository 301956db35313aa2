"""What a recording leaves open of how its grips carry tissue, by the base's tangent stiffness.

Whatever a grip does to the tissue about it, it does by how it moves what it holds. Jaws that turn or squeeze, rims that
give way, springs, balls that are none or that a mesh cannot show: beside all of them tissue moves as if what is held
were carried along by the grip's path and a field over it, here up to second order in place.
"""

from collections.abc import Iterator
from itertools import combinations_with_replacement

import numpy as np

from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import hats, knots
from surgisim.diagnosis.group import Group
from surgisim.diagnosis.ring_down import LATE
from surgisim.diagnosis.tangent import Tangent
from surgisim.mpm.grip import runs
from surgisim.mpm.setup import widened

FIRM = 0.15
"""Standard deviation of how much more or less than all of its path a grip carries along [1]."""
UNEVEN = 0.1
"""Of how far what is held goes otherwise at the skin of its ball, over the path: of each field of first and second
order, along each axis [1]. Chosen after opened recordings (docs/diagnosis.md, "Grips that are no balls")."""
PATH = 1e-4
"""Of where a grip carries tissue, from moment to moment [m]."""


def groups(clip: Clip, near: Tangent) -> list[Group]:
    """All of them; near: of the base's run."""
    return [firmness(clip, near), unevenness(clip, near), path(clip, near), closing(clip, near)]


def firmness(clip: Clip, near: Tangent) -> Group:
    """How firmly a gripped ball is carried along.

    A ball that is a little larger or smaller than it should be carries its surroundings by a constant share more or
    less; slipping, which begins at some moment, is not of that form.
    """
    result = []
    for j, way in _ways(clip):
        parts = _carried(clip, near, j)
        whole = np.einsum("dkti,td->kti", parts, way)
        reach = np.linalg.norm(way, axis=1)
        share = reach / max(reach.max(), 1e-9)
        result += [FIRM * whole, FIRM / 2 * whole * (2 * share - 1)[None, :, None]]
        result += [FIRM / 2 * parts[d] * reach[None, :, None] for d in range(3)]
    return Group("grip firmness", _to_the_end(result, clip))


def unevenness(clip: Clip, near: Tangent) -> Group:
    """What a grip holds carried otherwise here than there, as far as the grip has gone."""
    result, rest = [], near.prepared.simulator.rest.astype(float)
    wide = widened(clip.motion.radius, clip.body.spacing)
    for j, way in _ways(clip):
        reach = np.linalg.norm(way, axis=1)
        off = ((rest - clip.motion.center_rest[j]) / wide[j]).T
        for field in (*off, *(a * b for a, b in combinations_with_replacement(off, 2))):
            result += list(UNEVEN * _carried(clip, near, j, field) * reach[None, None, :, None])
    return Group("uneven grip", _to_the_end(result, clip))


def path(clip: Clip, near: Tangent) -> Group:
    """Where a grip carries tissue, from moment to moment."""
    result = []
    for j, _ in _ways(clip):
        parts, active = _carried(clip, near, j), clip.motion.active[j, : clip.until]
        courses = [bump * active for bump in hats(knots(clip), clip) if (bump * active).any()]
        result += [PATH * parts[d] * course[None, :, None] for course in courses for d in range(3)]
    return Group("grip path", _to_the_end(result, clip))


def closing(clip: Clip, near: Tangent) -> Group:
    """Grips that close sooner or later than their first frame: what they carry is ahead or behind by that much path."""
    result, values = [], []
    for j, _ in _ways(clip):
        parts = _carried(clip, near, j)
        for first, last in runs(clip.motion.active[j, : clip.until]):
            step = clip.motion.position[j, min(first + 1, last)] - clip.motion.position[j, first]
            if step.any():
                holds = (np.arange(clip.until) >= first) & (np.arange(clip.until) <= last)
                result.append(LATE * np.einsum("dkti,d->kti", parts, step) * holds[None, :, None])
                values.append((f"closing of grip {j} at frame {first}", LATE / clip.fps, "s"))
    return Group("closing", _to_the_end(result, clip), tuple(values))


def _ways(clip: Clip) -> Iterator[tuple[int, np.ndarray]]:
    """Number and displacement [m], (T_fit, 3), zero where it holds nothing, of each grip that fitted frames show."""
    for j, on in enumerate(clip.motion.active[:, : clip.until]):
        if on.any():
            yield j, np.where(on[:, None], clip.motion.position[j, : clip.until] - clip.motion.center_rest[j], 0.0)


def _carried(clip: Clip, near: Tangent, j: int, field: np.ndarray | None = None) -> np.ndarray:
    """Displacement of the points by a shift of grip j along each axis, of all it holds alike or of each particle by as
    much as `field` says, (P,), frame by frame [1], (3, K, T_fit, 3)."""
    loads = near.anchored(1 + j, field).T
    states = near.at_states(np.broadcast_to(loads, (len(near.frames), *loads.shape)))
    return np.stack([near.over_time(states[:, d], np.ones(clip.until)) for d in range(3)])


def _to_the_end(columns: list[np.ndarray], clip: Clip) -> np.ndarray:
    """Columns over the fitted frames, with nothing after them, (C, K, T, 3)."""
    whole = np.zeros((len(columns), len(clip.kept), clip.frames, 3))
    for n, column in enumerate(columns):
        whole[n, :, : clip.until] = column
    return whole
