"""The body laid anew with its held base at a chosen depth.

A camera does not see where tissue is held. Thickening fills everything behind the surface; here each column of it is
cut at one depth below the surface, with whole layers above the cut, so that the depth can change by any amount and the
simulation with it.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Self

import numpy as np
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import cKDTree

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.motion import Motion
from surgisim.estimation.observation import Observation
from surgisim.mpm.setup import Prepared

KEPT = 3
"""Bodies kept for each worker: one that several numbers are varied on, and the last ones beside it."""
NEIGHBOURS = 60
"""Columns whose plane the surface follows beyond what is seen."""
HELD = 1.0
"""Held tissue beyond what is free, in grid cells, below as at the rim: as far as the splines of what moves reach."""


@dataclass(frozen=True)
class Columns:
    """A thickened body as columns along z."""

    xy: np.ndarray
    """Camera frame [m], (N, 2)."""
    begin: np.ndarray
    """Where each column of tissue begins [m], (N,)."""
    above: np.ndarray
    """Depth of the seen surface above it [m], (N,)."""
    area: np.ndarray
    """Cross-section [m^2], (N,)."""
    color: np.ndarray
    """sRGB 0-1, (N, 3)."""
    seen: np.ndarray
    """Whether it begins at the seen surface, (N,) bool."""
    rim: np.ndarray
    """Whether it stands at the body's border, (N,) bool."""
    spacing: float
    """Of the grid [m]."""
    layer: float
    """Height of a layer of particles [m]."""
    thickness: float
    """How much tissue was laid below the surface, at the median column [m]."""
    flat: bool = False
    """Whether what holds it is flat, as deep below the surface's own plane, instead of following hills and hollows."""
    loose: np.ndarray | None = None
    """Which columns nothing holds, neither from below nor at the rim, (N,) bool; None where that is none."""
    torn: np.ndarray = field(default_factory=lambda: np.zeros((0, 2, 2)))
    """Walls through which it does not hang together, as `Body.torn`, (K, 2, 2) [m]."""

    def laid(self, depth: float, *, rim: bool, base: bool = True) -> Body:
        """The body whose tissue ends `depth` [m] below the surface, held there or not, and at its rim or not."""
        end = (self._plane if self.flat else self.above) + depth
        held = np.full(len(end), max(1, round(HELD * self.spacing / self.layer)) if base else 0)
        around = self.rim & rim
        if self.loose is not None:
            end = np.where(self.loose, self._bridged(end), end)
            held[self.loose], around = 0, around & ~self.loose
        free = np.maximum(np.rint((end - self.begin) / self.layer), 0).astype(int)
        kept = free > 0
        high = np.where(kept, (end - self.begin) / np.maximum(free, 1), self.layer)
        count = np.where(kept, free + held, 0)
        owner = np.repeat(np.arange(len(count)), count)
        level = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
        under = level >= free[owner]
        z = np.where(
            under,
            end[owner] + (level - free[owner] + 0.5) * self.layer,
            self.begin[owner] + (level + 0.5) * high[owner],
        )
        volume = self.area[owner] * np.where(under, self.layer, high[owner])
        return Body(
            rest=np.concatenate([self.xy[owner], z[:, None]], 1).astype(np.float32),
            volume=volume.astype(np.float32),
            color=self.color[owner].astype(np.float32),
            surface=(level == 0) & self.seen[owner],
            held=under | around[owner],
            spacing=self.spacing,
            torn=self.torn,
        )

    def _bridged(self, end: np.ndarray) -> np.ndarray:
        """Where columns end, (N,), with those of a loose piece that end before one beside them begins brought down to
        it: what moves as one hangs together, however steep its surface is in between."""
        who = np.flatnonzero(self.loose)
        pairs = cKDTree(self.xy[who]).query_pairs(self.spacing, output_type="ndarray")
        down = end.copy()
        for a, b in (who[pairs].T, who[pairs[:, ::-1]].T):
            np.maximum.at(down, a, np.where(self.above[b] > end[a], self.above[b] + self.spacing, end[a]))
        return down

    @property
    def pitch(self) -> np.ndarray:
        """How far apart columns stand along x and along y [m], (2,): a little unlike, as both ways they fill a box."""
        apart = [np.diff(np.unique(self.xy[:, a])) for a in (0, 1)]
        return np.array([np.median(d[d > 0.1 * self.spacing]) for d in apart])

    @property
    def _plane(self) -> np.ndarray:
        """Depth of the plane that lies nearest the surface, at every column [m], (N,)."""
        across = np.column_stack([self.xy, np.ones(len(self.xy))])
        return across @ np.linalg.lstsq(across, self.above, rcond=None)[0]


def beyond(columns: Columns, margin: float, held: float = 0.0) -> Columns:
    """The same with tissue around it as far as `margin` [m], and for another `held` [m] tissue that is its rim.

    Tissue does not end where the picture does. Beyond it the surface is the plane of the nearest columns.
    """
    pitch = columns.pitch
    low, high = columns.xy.min(0), columns.xy.max(0)
    more = np.rint((margin + held) / pitch).astype(int)
    x, y = (np.arange(-more[a], round((high[a] - low[a]) / pitch[a]) + more[a] + 1) * pitch[a] + low[a] for a in (0, 1))
    around = np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)
    known = cKDTree(columns.xy)
    away = known.query(around)[0]
    new = cKDTree(columns.xy / pitch).query(around / pitch)[0] > 0.7
    slack = 0.1 * pitch.min()
    chosen = new & (away <= margin + held + slack)
    around, away = around[chosen], away[chosen]
    near = known.query(around, k=min(NEIGHBOURS, len(columns.xy)))[1]
    place, z = columns.xy[near], columns.above[near]
    centre = place.mean(1, keepdims=True)
    slope = np.linalg.pinv(place - centre) @ (z - z.mean(1, keepdims=True))[..., None]
    above = z.mean(1) + ((around[:, None] - centre) @ slope)[:, 0, 0]
    count = len(around)
    return replace(
        columns,
        xy=np.concatenate([columns.xy, around]),
        begin=np.concatenate([columns.above, above]),
        above=np.concatenate([columns.above, above]),
        area=np.concatenate([columns.area, np.full(count, pitch.prod())]),
        color=np.concatenate([columns.color, columns.color[near[:, 0]]]),
        seen=np.concatenate([columns.seen, np.zeros(count, bool)]),
        rim=np.concatenate([np.zeros(len(columns.rim), bool), away > margin + slack]),
        loose=None if columns.loose is None else np.concatenate([columns.loose, columns.loose[near[:, 0]]]),
    )


def finer(columns: Columns, times: float) -> Columns:
    """The same tissue in columns and layers that many times as fine, for a grid as much finer."""
    pitch = columns.pitch
    low, high = columns.xy.min(0), columns.xy.max(0)
    counts = np.rint((np.rint((high - low) / pitch) + 1) * times).astype(int)
    x, y = (
        low[a] - 0.5 * pitch[a] + (high[a] - low[a] + pitch[a]) * (np.arange(n) + 0.5) / n for a, n in enumerate(counts)
    )
    place = np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)
    # Every new column stands within one of the old.
    away, owner = cKDTree(columns.xy / pitch).query(place / pitch, p=np.inf)
    place, owner = place[away < 0.501], owner[away < 0.501]
    both = np.stack([columns.begin, columns.above], -1)
    smooth = LinearNDInterpolator(columns.xy, both)(place)
    begin, above = np.where(np.isfinite(smooth), smooth, both[owner]).T
    return replace(
        columns,
        xy=place,
        begin=begin,
        above=np.minimum(above, begin),
        area=np.full(len(place), columns.area.sum() / len(place)),
        color=columns.color[owner],
        seen=columns.seen[owner],
        rim=columns.rim[owner],
        loose=None if columns.loose is None else columns.loose[owner],
        spacing=columns.spacing / times,
        layer=columns.layer / times,
    )


@dataclass(frozen=True)
class Laying:
    """Bodies for every depth and grip that a search comes to, each made once while it is needed."""

    columns: Columns
    """Of what is seen."""
    margin: float
    """How far tissue goes on beyond that [m]."""
    rim: bool
    """Whether it is held where it ends there."""
    observation: Observation
    make: Callable[..., Prepared]
    """Prepare a body under a motion whose grips it will feel, on so many `threads`."""
    base: bool = True
    """Whether it is held from below."""
    kept: dict = field(default_factory=dict, compare=False)

    def ending(self, margin: float, rim: bool) -> Self:
        """The same with another edge."""
        return replace(self, margin=margin, rim=rim, kept={})

    @property
    def loose(self) -> float:
        """Share of what is seen that nothing holds."""
        return 0.0 if self.columns.loose is None else float(self.columns.loose.mean())

    def parted(self, loose: np.ndarray, walls: np.ndarray) -> Self:
        """The same in which nothing holds the `loose` columns from below, (N,) bool, nor anything across `walls`."""
        return replace(self, columns=replace(self.columns, loose=loose, torn=walls), kept={})

    def finer(self, times: float) -> Self:
        """The same on a grid that many times as fine."""
        return replace(self, columns=finer(self.columns, times), kept={})

    def shared(self, threads: int) -> Self:
        """The same with bodies of which several threads each simulate a share."""
        return replace(self, make=partial(self.make, threads=threads), kept={})

    @cached_property
    def whole(self) -> Columns:
        """With what lies beyond the picture."""
        held = HELD * self.columns.spacing if self.rim else 0.0
        return beyond(self.columns, self.margin, held) if self.margin + held > 0 else self.columns

    def at(self, depth: float, motion: Motion, worker: int) -> tuple[Prepared, Observation]:
        """A body held from `depth` [m] on, and what it is compared with; `worker`: whose arrays it uses."""
        # Laid for the rounded numbers: which of several that round alike comes first is for the threads to race for.
        depth = round(depth, 7)
        motion = replace(motion, center_rest=np.round(motion.center_rest, 7), radius=np.round(motion.radius, 7))
        key = (depth, motion.center_rest.tobytes(), motion.radius.tobytes())
        mine = self.kept.setdefault(worker, {})
        if key not in mine:
            if len(mine) >= KEPT:
                mine.pop(next(iter(mine)))
            # Another worker's has all but its own arrays on the device.
            laid = next(filter(None, (theirs.get(key) for theirs in list(self.kept.values()))), None)
            if laid:
                mine[key] = replace(laid[0], simulator=laid[0].simulator.beside()), laid[1]
            else:
                prepared = self.make(self.whole.laid(depth, rim=self.rim, base=self.base), motion)
                mine[key] = prepared, self.observation.carried_by(prepared.simulator)
        return mine[key]


def upright(body: Body, camera: Camera) -> Columns | None:
    """What `thicken` laid, read back: columns share their place across the view, to rounding. None if it has none."""
    rest = body.rest.astype(float)
    place, owner, count = np.unique(np.round(rest[:, :2], 7), axis=0, return_inverse=True, return_counts=True)
    owner = owner.ravel()
    if np.median(count) < 2:
        return None
    order = np.lexsort((rest[:, 2], owner))
    first = order[np.concatenate([[0], np.cumsum(count)[:-1]])]
    last = order[np.cumsum(count) - 1]
    layer = float(np.median(np.diff(rest[order, 2])[np.diff(owner[order]) == 0]))
    area = np.bincount(owner, body.volume.astype(float)) / (rest[last, 2] - rest[first, 2] + layer)
    begin = rest[first, 2] - 0.5 * body.volume[first] / area
    seen = body.surface[first]
    top = cKDTree(camera.project(rest[first][seen])).query(camera.project(rest[first]))[1]
    above = np.where(seen, begin, np.minimum(begin[seen][top], begin))
    thickness = float(np.median(rest[last, 2] - rest[first, 2]) + layer)
    rim = body.held[first]
    return Columns(place, begin, above, area, body.color[first], seen, rim, body.spacing, layer, thickness)
