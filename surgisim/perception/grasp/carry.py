"""Where held tissue is carried, in space."""

from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d, median_filter

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.depth import Depth
from surgisim.artifacts.motion import Motion
from surgisim.perception.grasp.find import Grip
from surgisim.perception.tracking import Paths
from surgisim.perception.tracking.between import sample

SHOWN = 3
"""Held points that must be seen for their way to be known."""
ASTRAY, SLACK = 0.35, 0.015
"""How far the ring may end from where the jaws take it, as a share of their way; and of the longer image side."""
AROUND, OFTEN, LEAST = 4.0, 0.8, 10
"""Radii of a grip within which tissue tells the course of its way in time; share of the frames in which such a point is
seen; points at least."""
EDGE, ALIKE, DISC = 0.1, 0.03, 0.6
"""Where depth's change is measured: how much nearer or farther than the jaws as they close the depth at a grip's place
is, as a share, if that lies beside an edge of depth; how near to theirs the depth of what they hold is, as a share; and
radii of a grip within which depth is theirs."""
LAGS = 0.6
"""How far behind its tip, as a share of the way, tissue around jaws may stay that is carried by them."""
STRAYS, SEEN = 0.003, 0.5
"""Error of a tip's place from which a frame counts less, as a share of the longer image side; least share of the frames
that show it, and of those in which it goes as the tissue does, within twice that error."""
COURSES, ELSE = 2, 0.2
"""Courses in time of which all tissue around a pull has its share: with two, a way's course is .3 % off (root mean
square, as a share of its length; 38 and 40 clips of families 27182 and 16180) where the ring alone has it 1.0 and .7 %
off. Share of the way that may be none of them: beyond, the ring has the word."""


def carry(
    grips: list[Grip],
    paths: Paths,
    jaws: list[np.ndarray | None],
    tips: list[np.ndarray | None],
    depth: Depth,
    camera: Camera,
    source: str,
) -> Motion:
    """The grips as balls in the camera frame [m] and their ways.

    paths: tissue points about each grip, hidden ones too. jaws: the motion of each grip's jaws to the next frame [px],
    (T, 2), tips: where their tips are by the instruments' outlines [px], (T, 2), none if they are not known. The ball
    is carried by its tip, where that goes as the tissue around it does in time; else by the ring of tissue around the
    jaws that moves as one with it, and where that is hidden, or is seen to go elsewhere than the jaws, by the jaws.
    """
    frames = paths.xy.shape[1]
    z = _depth_at(depth, paths.xy)
    center, radius, position, active = [], [], [], []
    for grip, step, tip in zip(grips, jaws, tips, strict=True):
        middle, rest_z, theirs = _rest(grip, paths, depth, marked=source == "given")
        grip = replace(grip, center=middle)
        held = np.linalg.norm(paths.xy[:, 0] - grip.center, axis=-1)
        ring = held <= max(grip.radius, np.sort(held)[min(8, len(held) - 1)])
        place, deep = _course(paths, z, ring, step, tip, grip, max(camera.width, camera.height))
        if theirs is not None:
            deep = _at_jaws(depth, grip.center + place, grip, theirs)
        way = camera.lift(grip.center + place, rest_z + deep)
        rest = camera.lift(grip.center, np.array(rest_z))
        way[: grip.begin + 1] = rest
        way[grip.end + 1 :] = way[grip.end]
        center.append(rest)
        radius.append(grip.radius * rest_z / camera.fx)
        position.append(way)
        active.append((np.arange(frames) >= grip.begin) & (np.arange(frames) <= grip.end))
    count = len(grips)
    return Motion(
        center_rest=np.array(center).reshape(count, 3),
        radius=np.array(radius).reshape(count),
        position=np.array(position).reshape(count, frames, 3),
        active=np.array(active, bool).reshape(count, frames),
        confidence=np.array([g.confidence for g in grips]).reshape(count),
        source=source if count else "none",
    )


def _rest(grip: Grip, paths: Paths, depth: Depth, marked: bool) -> tuple[np.ndarray, float, float | None]:
    """Where in frame 0 the held tissue lies [px], (2,), how deep [m], and beside an edge of depth how deep the jaws are
    as they close [m].

    Beside one, a place a few pixels off is on other tissue: what jaws hold is as deep as they are when they close. A
    place that was marked is taken at its word.
    """
    z = depth.z[0].astype(np.float32)
    here = float(sample(z, grip.center[None, None].astype(np.float32))[0, 0])
    if marked or not depth.follows:
        return grip.center, here, None
    near = np.argsort(np.linalg.norm(paths.xy[:, 0] - grip.center, axis=-1))[:9]
    closing = range(grip.begin, min(grip.begin + SHOWN, grip.end) + 1)
    moved = [np.median(paths.xy[near, t] - paths.xy[near, 0], axis=0) for t in closing]
    theirs = float(np.median([_disc(depth.z[t], grip.center + m, grip) for t, m in zip(closing, moved, strict=True)]))
    if abs(here - theirs) <= EDGE * theirs:
        return grip.center, here, None
    y, x = np.mgrid[: z.shape[0], : z.shape[1]]
    away = np.hypot(x - grip.center[0], y - grip.center[1])
    deep = (np.abs(z - theirs) <= ALIKE * theirs) & (away <= 2 * grip.radius)
    if not deep.any():
        return grip.center, here, None
    k = np.flatnonzero(deep.ravel())[away[deep].argmin()]
    place = np.array([x.ravel()[k], y.ravel()[k]], float)
    return place, float(z.ravel()[k]), theirs


def _disc(z: np.ndarray, at: np.ndarray, grip: Grip) -> float:
    """Depth of what is about a place [px], (2,), as far as the jaws reach [m]: the median there."""
    y, x = np.mgrid[: z.shape[0], : z.shape[1]]
    away = np.hypot(x - at[0], y - at[1])
    return float(np.median(z[away <= max(DISC * grip.radius, away.min())]))


def _at_jaws(depth: Depth, at: np.ndarray, grip: Grip, theirs: float) -> np.ndarray:
    """How much farther off than as they closed, `theirs` [m], the jaws are [m], (T,), at places (T, 2) [px]."""
    deep = np.array([_disc(z, p, grip) for z, p in zip(depth.z, at, strict=True)]) - theirs
    held = slice(grip.begin, grip.end + 1)
    deep[held] = gaussian_filter1d(median_filter(deep[held], 3, mode="nearest"), 1.5, mode="nearest")
    deep[held] -= _fading(grip) * deep[grip.begin]
    return deep


def _fading(grip: Grip) -> np.ndarray:
    """What is left, while it holds, of what smoothing or noise puts at its begin, where it is at rest, (F,)."""
    return np.exp(-np.arange(grip.end + 1 - grip.begin) / 2.0)


def _depth_at(depth: Depth, xy: np.ndarray) -> np.ndarray:
    """z under each path [m], (K, T)."""
    at = xy.swapaxes(0, 1)[:, :, None]
    return np.stack([sample(depth.z[t].astype(np.float32), at[t])[:, 0] for t in range(len(at))], 1)


def _course(
    paths: Paths,
    z: np.ndarray,
    ring: np.ndarray,
    jaws: np.ndarray | None,
    tip: np.ndarray | None,
    grip: Grip,
    side: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Displacement across [px], (T, 2), and along the view [m], (T,), of the held ball, smoothed in time."""
    moved = (paths.xy[ring] - paths.xy[ring, :1]).astype(float)
    deep = (z[ring] - z[ring, :1]).astype(float)
    seen = paths.visible[ring]
    frames = moved.shape[1]
    across, along = np.zeros((frames, 2)), np.zeros(frames)
    for t in range(frames):
        who = seen[:, t] if seen[:, t].sum() >= 3 else np.ones(ring.sum(), bool)
        across[t] = np.median(moved[who, t], axis=0)
        # The ball moves as one and measured depth is too smooth: the most displaced fifth is nearest the truth.
        along[t] = np.percentile(deep[who, t], 20 if np.median(deep[who, t]) < 0 else 80)
    if jaws is not None:
        across = _with_jaws(across, seen.sum(0) >= SHOWN, jaws, grip, side)
    across = _as_around(across, tip, paths, grip, side)
    stretch = slice(grip.begin, grip.end + 1)
    across[stretch] = gaussian_filter1d(across[stretch], 0.7, axis=0, mode="nearest")
    along[stretch] = gaussian_filter1d(along[stretch], 1.5, axis=0, mode="nearest")
    fade = _fading(grip)
    across[stretch] -= fade[:, None] * across[grip.begin]
    along[stretch] -= fade * along[grip.begin]
    return across, along


def _as_around(across: np.ndarray, tip: np.ndarray | None, paths: Paths, grip: Grip, side: int) -> np.ndarray:
    """`across` (T, 2), or the way of the `tip` (T, 2) [px], with the course in time that the tissue around the grip has
    while it holds.

    A ring is a few points, some of which jaws hide now and then, and lags behind them; what it carries along is
    hundreds, each of which goes some share of its way. A tip is on its own until it holds.
    """
    frames = np.arange(grip.begin, grip.end + 1)
    away = np.linalg.norm(paths.xy[:, 0] - grip.center, axis=-1)
    beside = (away > grip.radius) & (away < AROUND * grip.radius)
    who = beside & (paths.visible[:, frames].mean(1) > OFTEN)
    if who.sum() < LEAST or len(frames) <= 2 * COURSES:
        return across
    xy, seen = paths.xy[who][:, frames].astype(float), paths.visible[who][:, frames]
    way = np.stack(
        [np.interp(frames, frames[s], p[s, axis]) for p, s in zip(xy, seen, strict=True) for axis in range(2)]
    )
    courses = np.linalg.svd(way - way[:, :1], full_matrices=False)[2][:COURSES].T
    courses = courses - courses[0]
    found = across[frames] - across[grip.begin]
    fitted = courses @ np.linalg.lstsq(courses, found, rcond=None)[0]
    by_tip = None if tip is None else _by_tip(tip[frames], courses, STRAYS * side)
    if by_tip is not None and np.linalg.norm(found - by_tip) < LAGS * np.linalg.norm(by_tip):
        fitted = by_tip
    elif np.linalg.norm(found - fitted) > ELSE * np.linalg.norm(found):
        return across
    out = across.copy()
    out[frames] = across[grip.begin] + fitted
    return out


def _by_tip(tip: np.ndarray, courses: np.ndarray, strays: float) -> np.ndarray | None:
    """The share of a tip's places (F, 2) [px], NaN where unknown, that follows the courses (F, C) from 0, (F, 2).

    None if it is seen in too few frames, or if less than half of those go so.
    """
    known = np.isfinite(tip).all(1)
    if known.mean() < SEEN:
        return None
    basis = np.column_stack([np.ones(len(courses)), courses])
    weight = known.astype(float)
    for _ in range(20):
        heavy = np.sqrt(weight[known])[:, None]
        gone = np.linalg.lstsq(heavy * basis[known], heavy * tip[known], rcond=None)[0]
        off = np.linalg.norm(np.where(known[:, None], tip, 0.0) - basis @ gone, axis=1)
        weight = known / (1 + (off / strays) ** 2)
    way = courses @ gone[1:]
    return way if (off[known] < 2 * strays).mean() > SEEN else None


def _with_jaws(across: np.ndarray, shown: np.ndarray, jaws: np.ndarray, grip: Grip, side: int) -> np.ndarray:
    """`across` (T, 2), moved on by the jaws' steps (T, 2) [px] from where it was last `shown` (T,) and with them."""
    out, last = across.copy(), grip.begin
    guessed = np.diff(across, axis=0, append=across[-1:])
    step = np.where(np.isfinite(jaws), jaws, guessed)
    way = np.zeros_like(out)
    way[grip.begin + 1 :] = np.cumsum(step[grip.begin : -1], axis=0)
    for t in range(grip.begin + 1, grip.end + 1):
        out[t] = out[t - 1] + step[t - 1]
        # Tissue that is held goes where the jaws go; a ring that does not has been lost, or was never held.
        astray = np.linalg.norm(across[t] - across[grip.begin] - way[t])
        if shown[t] and astray < ASTRAY * np.linalg.norm(way[t]) + SLACK * side:
            share = np.arange(last + 1, t + 1)[:, None] - last
            out[last + 1 : t + 1] += share / (t - last) * (across[t] - out[t])
            last = t
    return out
