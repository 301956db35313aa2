"""Tissue that goes along with a grip and is not held from below, and where it is not joined to what stays beside it.

A strip before a wall, a tube on the organs behind it, a lobe: depth from one view glues them into one block. Tracks
part them: what moves as one with the grip is one piece, and where it slides past what stays beside it, by more than the
way between them, nothing joins the two. Elsewhere it hangs on.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.ndimage import median_filter
from scipy.spatial import cKDTree

from surgisim.artifacts.motion import Motion
from surgisim.artifacts.tracks import Tracks
from surgisim.estimation.lay import Columns

MOVES = 0.25
"""Share of the liveliest points' way (95th percentile) from which tissue goes along, as in the metrics of a replay."""
VOTERS = 5
"""Tracked points that say whether a column does."""
SMALLEST = 2.0
"""Least extent of a piece, in grid cells across."""
REACH = 1.5
"""How far from a border tracked points say how its two sides go, in grid cells."""
BEYOND = 100.0
"""How far a wall goes on where what is seen ends, in columns."""
FEWEST = 3
"""Points on either side that say it."""
TORN = 0.5
"""Way of one side past the other, as a share of the way between them, from which nothing joins them: chosen on one
strip that this engine simulated, at 1 no wall of it was found."""


@dataclass(frozen=True)
class Piece:
    """What goes along with the grips."""

    loose: np.ndarray
    """Which columns it is, (N,) bool."""
    middles: np.ndarray
    """Where those stand, camera frame x and y [m], (L, 2)."""
    walls: np.ndarray
    """Where it is not joined to its surroundings, as `Body.torn`, (K, 2, 2) [m]."""


def seen_piece(columns: Columns, tracks: Tracks, motion: Motion) -> Piece | None:
    """The columns that move with a grip, and where tracks part them from the rest; None where all or hardly any do.

    Tracked points count at rest, in frame 0, by how far they go in the picture.
    """
    rest, known = tracks.xyz[:, 0, :2].astype(float), tracks.visible[:, 0] & np.isfinite(tracks.xyz[:, 0]).all(1)
    known &= tracks.visible.sum(1) > FEWEST
    rest, seen = rest[known], tracks.visible[known]
    moved = median_filter(tracks.xy[known] - tracks.xy[known][:, :1], (1, 3, 1), mode="nearest")
    if len(rest) < 2 * VOTERS:
        return None
    far = np.where(seen, np.linalg.norm(moved, axis=-1), 0.0).max(1)
    lively = far > MOVES * np.percentile(far, 95)
    votes = lively[cKDTree(rest).query(columns.xy, VOTERS)[1]].mean(1)
    lattice = _Lattice.of(columns)
    loose = lattice.spread(votes > 0.5)
    labels, _ = ndimage.label(loose)
    size = (SMALLEST * columns.spacing) ** 2 / columns.pitch.prod()
    mine = np.zeros_like(loose)
    for center in motion.center_rest[:, :2]:
        near = np.linalg.norm(columns.xy - center, axis=1) <= SMALLEST * columns.spacing
        for label in np.unique(labels[tuple(lattice.cell[near].T)]):
            if label and (labels == label).sum() >= size:
                mine |= labels == label
    loose = mine[tuple(lattice.cell.T)]
    if not loose.any() or loose.all():
        return None
    return Piece(
        loose, columns.xy[loose], _walls(lattice, columns, mine, tracks.xy[known][:, 0], rest, lively, moved, seen)
    )


@dataclass(frozen=True)
class _Lattice:
    """Columns by row and column."""

    cell: np.ndarray
    """Of each, (N, 2) int."""
    low: np.ndarray
    """Place of the first [m], (2,)."""
    pitch: np.ndarray
    """[m], (2,)."""

    @classmethod
    def of(cls, columns: Columns) -> "_Lattice":
        low, pitch = columns.xy.min(0), columns.pitch
        return cls(np.rint((columns.xy - low) / pitch).astype(int), low, pitch)

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Values of the columns, (N,), on the lattice; false where none stands."""
        grid = np.zeros(self.cell.max(0) + 1, bool)
        grid[tuple(self.cell.T)] = values
        return grid


def _walls(
    lattice: _Lattice,
    columns: Columns,
    loose: np.ndarray,
    start: np.ndarray,
    rest: np.ndarray,
    lively: np.ndarray,
    moved: np.ndarray,
    seen: np.ndarray,
) -> np.ndarray:
    """Walls between columns that are loose and those beside them that are not, where tracks slide past each other."""
    there, trees = lattice.spread(np.ones(len(columns.xy), bool)), [cKDTree(rest[side]) for side in (lively, ~lively)]
    reach, walls = REACH * columns.spacing, []
    for axis in (0, 1):
        border = (loose != np.roll(loose, -1, axis)) & there & np.roll(there, -1, axis)
        border[(-1, slice(None)) if axis == 0 else (slice(None), -1)] = False
        for cell in np.argwhere(border):
            middle = lattice.low + (cell + 0.5 * np.eye(2)[axis]) * lattice.pitch
            along = 0.5 * np.eye(2)[1 - axis] * lattice.pitch
            near = [np.array(tree.query_ball_point(middle, reach), int) for tree in trees]
            sides = [np.flatnonzero(side)[n] for side, n in zip((lively, ~lively), near, strict=True)]
            if _parted(*sides, start, moved, seen):
                ends = [_outward(there, cell, sign * np.eye(2, dtype=int)[1 - axis]) for sign in (-1, 1)]
                walls.append([middle - (1 + ends[0]) * along, middle + (1 + ends[1]) * along])
    return np.array(walls).reshape(-1, 2, 2)


def _outward(there: np.ndarray, cell: np.ndarray, way: np.ndarray) -> float:
    """How much longer a wall beside a column is that ends where what is seen does: tissue may go on beyond that."""
    ahead = cell + way
    inside = (ahead >= 0).all() and (ahead < there.shape).all() and there[tuple(ahead)]
    return 0.0 if inside else BEYOND


def _parted(one: np.ndarray, other: np.ndarray, start: np.ndarray, moved: np.ndarray, seen: np.ndarray) -> bool:
    """Whether two groups of points, by number, go past each other by more than the way between their middles."""
    both = (seen[one].sum(0) >= FEWEST) & (seen[other].sum(0) >= FEWEST)
    past = [
        np.median(moved[one, t][seen[one, t]], 0) - np.median(moved[other, t][seen[other, t]], 0)
        for t in np.flatnonzero(both)
    ]
    if len(past) < FEWEST:
        return False
    between = np.linalg.norm(np.median(start[one], 0) - np.median(start[other], 0))
    return bool(np.sort(np.linalg.norm(past, axis=1))[-FEWEST] > TORN * between)
