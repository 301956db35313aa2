"""How far pulled tissue comes nearer, from how it goes across the view and how its brightness changes.

Tissue that jaws carry off takes its surroundings along as a soft layer does (soft_layer.py): place and size of the held
ball, the layer's thickness and the pull decide the motion of the whole surface, along the view too. These few numbers
are fitted to the motion seen across the view, which tells most of them, to the change of brightness, which tells
best how far the surface turns and comes nearer, and to the way of the instrument that holds the ball
(grasp/outline.py). First to the pattern that most of the recording's motion shares; then, with place and size kept, to
every frame.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from surgisim.lighting.headlight import MATTE
from surgisim.perception.depth.shading import Lattice
from surgisim.perception.depth.soft_layer import SoftLayer
from surgisim.perception.grasp.outline import PARTS, Outline

RADIUS, RADIUS_SPREAD = 0.06, 0.2
"""Expected radius of a held ball, as a share of the distance; spread of its logarithm."""
THICKNESS, THICKNESS_SPREAD = 2.2, 0.4
"""Expected thickness of the layer over that radius; spread of its logarithm."""
LIFT, LIFT_SPREAD = 0.5, 0.4
"""Expected angle between the pull and the tissue's surface, toward the camera, and its spread [rad]."""
NEAR = 0.1
"""Spread of the held ball's centre, each way, about where most motion is seen, as a share of the distance."""
TILT = 0.1
"""Spread of the slope of the whole surface, each way, about that which frame 0's brightness suggests."""
MATTE_SPREAD = 0.15
"""Spread of how far brightness follows the angle, about what is expected of it."""
ACROSS, SHAPE, FAR = 0.15, 0.12, 0.25
"""Errors of the motion across the view: of the tracking [px of the lattice], and of the layer's as shares of the motion
nearby and of the largest motion."""
LIGHT = 0.05
"""Least spread of log brightness along a tissue point's way; more where still tissue's changes more."""
ENOUGH = 20
"""Lattice pixels of still tissue that tell how light changes without motion."""
ALIKE = 20.0
"""Lattice pixels whose errors go together."""
FULL, LIVELY = 0.8, 0.1
"""Share of the largest motion in time from which a frame counts as fully pulled; in space, from which light counts."""
CLEAR = 0.6
"""Sureness below which motion across the view counts for nothing."""
ROBUST = 1.5
"""Standard deviations from which errors count linearly."""
STARTS = (0.1, 1.0)
"""Angles of the pull that the fit begins with [rad]."""
STEADY, LOOSE = 0.15, 0.03
"""Spread of a frame's pull about the shared one times the frame's share; as a share of the whole pull."""
BEGUN = 0.15
"""Share of the largest motion from which on, up to the last fully pulled frame, jaws are known to hold the tissue."""
REACHES = 0.2
"""Farthest from the liveliest tissue, once pulled, that the tip of its instrument may be, a share of the distance."""
TIP, WIDTH = 0.3, 0.01
"""Least errors of where an outline's tip is [px of the lattice], and of the logarithm of how wide it is."""
FEW = 4
"""Frames that tell how an instrument goes."""
VISIBLE = 0.5
"""Motion across the view below which nothing is said to be pulled [px of the lattice]."""
STEPS = np.array([0.004, 0.004, 0.03, 0.05, 0.003, 0.003, 0.003, 0.01, 0.01, 0.02])
"""Over which derivatives by the ten numbers of `_fitted` are taken, lengths over the distance."""


@dataclass(frozen=True)
class Watched:
    """What T frames show of frame 0's tissue, K = h w lattice pixels."""

    ray: np.ndarray
    """X and Y of (X, Y, 1) at which it is seen, (T, K, 2)."""
    sure: np.ndarray
    """How surely, 0-1, (T, K)."""
    light: np.ndarray
    """Log brightness, (T, K)."""
    lit: np.ndarray
    """How far the tissue's own light is seen, 0-1, (T, K)."""


@dataclass(frozen=True)
class _Scene:
    """What is compared, lengths over the tissue's median depth."""

    lattice: Lattice
    layer: SoftLayer
    rest: np.ndarray
    """Tissue in frame 0, (K, 3)."""
    slope: np.ndarray
    """dz/dx and dz/dy of the plane through it, (2,)."""
    ray: np.ndarray
    """At which it is seen once moved, (K, 2)."""
    across: np.ndarray
    """Its motion across the view, were its depth kept, (K, 2)."""
    brighter: np.ndarray
    """Change of log brightness, (K,)."""
    weight_across: np.ndarray
    """1 / standard deviation, of which ALIKE go together, (K,)."""
    weight_light: np.ndarray
    jaws: np.ndarray
    """How far the held ball has gone by its instrument: X and Y of (X, Y, 1) and log depth, (3,); NaN if unknown."""
    weight_jaws: np.ndarray
    """1 / standard deviation, (3,)."""


@dataclass(frozen=True)
class _Carried:
    """How far an instrument's tip goes: X and Y of (X, Y, 1) and the logarithm of its distance; NaN if unknown."""

    whole: np.ndarray
    """By the whole pull, (3,)."""
    each: np.ndarray
    """In every frame, (T, 3)."""
    error: np.ndarray
    """Standard deviations, (3,)."""


def nearer(
    lattice: Lattice, rest: np.ndarray, watched: Watched, tools: Sequence[Outline] = ()
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Change of log depth of frame 0's tissue by a pull, (T, h, w), 0 where nothing is seen to move; its place; and how
    far the layer explains the motion seen, 0-1, (T,).

    The place is X and Y of (X, Y, 1), (T, K, 2): as seen where that is sure, else as the layer has it.
    rest: log depth in frame 0, (h, w). tools: the instruments, one of which may hold the tissue.
    """
    scale = np.median(rest)
    z = np.exp(rest - scale).ravel()
    tissue = np.concatenate([watched.ray[0], np.ones((len(z), 1))], -1) * z[:, None]
    across = watched.ray * z[:, None] - tissue[:, :2]
    everywhere = _everywhere(across)
    across = across - everywhere
    pixel = 2 / np.abs(lattice.along_x).sum(1).max()
    pattern, course, sure = _shared(across, np.where(watched.sure > CLEAR, watched.sure, 0.0) ** 2)
    size = np.linalg.norm(pattern, axis=-1) * sure
    largest = np.percentile(size, 99.5)
    change = np.zeros((len(course), *lattice.shape))
    explained = np.ones(len(course))
    if largest < VISIBLE * pixel:
        return change, watched.ray, explained
    lit = watched.lit * watched.lit[0] * watched.sure
    still = (lit > 0.5) & (np.linalg.norm(across, axis=-1) < pixel / 2)
    brighter = _without_gain(watched.light - watched.light[0], still)
    restless = _restless(brighter, still)
    around = _smooth(size, sure, lattice.shape)
    noise = np.hypot(np.hypot(ACROSS * pixel, SHAPE * around), FAR * largest) * np.sqrt(ALIKE)
    lively = (around > LIVELY * largest) / np.sqrt(ALIKE)
    full = course > FULL
    liveliest = np.argmax(around)
    jaws = _carried(tools, course, watched.ray[:, liveliest], everywhere[:, 0], pixel)
    scene = _Scene(
        lattice,
        SoftLayer.solved(),
        tissue,
        _slope(tissue),
        watched.ray[full].mean(0),
        pattern,
        (lit[full] * brighter[full]).sum(0) / np.maximum(lit[full].sum(0), 1e-6),
        np.sqrt(sure) / noise,
        lit[full].mean(0) * lively / np.hypot(LIGHT, np.median(restless[full])),
        jaws.whole,
        1 / jaws.error,
    )
    best = _fitted(scene, tissue[liveliest, :2], pattern)
    place = watched.ray.copy()
    for t, share in enumerate(course):
        now = replace(
            scene,
            ray=watched.ray[t],
            across=across[t],
            brighter=brighter[t],
            weight_across=np.where(watched.sure[t] > CLEAR, watched.sure[t], 0.0) / noise,
            weight_light=lit[t] * lively / np.hypot(LIGHT, restless[t]),
            jaws=jaws.each[t],
        )
        moved, explained[t] = _moved(now, best, share)
        change[t] = np.log1p(np.maximum(explained[t] * moved[:, 2] / z, -0.8)).reshape(lattice.shape)
        layer = (tissue + moved)[:, :2] / (tissue + moved)[:, 2:] + everywhere[t] / z[:, None]
        place[t] += explained[t] * (1 - watched.sure[t])[:, None] * (layer - place[t])
    return change, place, explained


def _carried(
    tools: Sequence[Outline], course: np.ndarray, place: np.ndarray, everywhere: np.ndarray, pixel: float
) -> _Carried:
    """How the tip goes of the instrument that is nearest to the pulled tissue, which is seen at `place` (T, 2).

    What its way shares with the tissue's course (T,) while it is there: before it closes and after it lets go it is on
    its own. everywhere: motion of the whole view, (T, 2).
    """
    unknown = _Carried(np.full(3, np.nan), np.full((len(course), 3), np.nan), np.ones(3))
    full = np.flatnonzero(course > FULL)
    frames = np.arange(np.flatnonzero(course > BEGUN)[0], full[-1] + 1)
    away = [np.median(np.linalg.norm(tool.ray(full) - place[full], axis=-1)) for tool in tools]
    if not np.nanmin([*away, np.inf]) < REACHES:
        return unknown
    tool = tools[np.nanargmin(away)]
    frames = frames[np.linalg.norm(tool.ray(frames) - place[frames], axis=-1) < REACHES]
    way = tool.carried(frames, full[len(full) // 2])
    seen = np.isfinite(way[:, :3]).all(1)
    if seen.sum() < FEW or np.ptp(course[frames[seen]]) < BEGUN or np.isfinite(way[seen, 3:]).all(0).sum() < 2:
        return unknown
    frames, way = frames[seen], way[seen]
    way[:, :2] -= everywhere[frames]
    share = course[frames] - course[frames].mean()
    by_mask = tool.ray(frames) - everywhere[frames]
    size = share @ share
    whole = share @ way / size
    # Where an outline ends its tip tells alone, and the mask tells it another way.
    apart = np.linalg.norm(whole[:2] - share @ by_mask / size)
    contradict = 1.48 * np.nanmedian(np.abs(whole[3:] - np.nanmedian(whole[3:]))) / np.sqrt(PARTS)
    each = unknown.each
    each[frames] = way[:, :3] - way[:, :3].mean(0) + whole[:3] * course[frames].mean()
    error = np.array([*[np.hypot(apart, TIP * pixel)] * 2, np.hypot(contradict, WIDTH)])
    return _Carried(whole[:3], each, error)


def _everywhere(across: np.ndarray) -> np.ndarray:
    """Motion of the tenth of the view that moves least, (T, 1, 2): what even that does is the camera's doing."""
    far = np.linalg.norm(across, axis=-1)
    least = far <= np.percentile(far, 10, axis=1, keepdims=True)
    return ((least[..., None] * across).sum(1) / least.sum(1)[:, None])[:, None]


def _slope(tissue: np.ndarray) -> np.ndarray:
    """dz/dx and dz/dy of the plane through points (K, 3), (2,)."""
    flat = np.concatenate([tissue[:, :2], np.ones((len(tissue), 1))], -1)
    return np.linalg.lstsq(flat, tissue[:, 2], rcond=None)[0][:2]


def _shared(across: np.ndarray, sure: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The pattern (K, 2) that most motion (T, K, 2) shares, its share in every frame (T,), how surely seen (K,)."""
    weight = sure[..., None]
    energy = (weight * across**2).sum((1, 2))
    course = np.sqrt(energy / max(energy.max(), 1e-12))
    for _ in range(10):
        seen = (sure * course[:, None] ** 2).sum(0)
        pattern = (weight * course[:, None, None] * across).sum(0) / (seen + 1e-6)[:, None]
        course = (weight * across * pattern).sum((1, 2)) / ((weight * pattern**2).sum((1, 2)) + 1e-12)
        # What goes farthest may go the other way than what lasts longest.
        size = course[np.abs(course).argmax()]
        size = size if abs(size) > 1e-12 else 1e-12
        course, pattern = course / size, pattern * size
    return pattern, course, (sure * course[:, None] ** 2).sum(0) / max((course**2).sum(), 1e-12)


def _without_gain(brighter: np.ndarray, still: np.ndarray) -> np.ndarray:
    """Changes (T, K) less what tissue that stands still, (T, K) bool, does: exposure and lamp."""
    gain = [np.median(b[s]) if s.sum() > ENOUGH else 0.0 for b, s in zip(brighter, still, strict=True)]
    return brighter - np.array(gain)[:, None]


def _restless(brighter: np.ndarray, still: np.ndarray) -> np.ndarray:
    """Spread of the change of brightness where tissue stands still, in every frame, (T,): smoke that drifts, say."""
    return np.array(
        [1.4826 * np.median(np.abs(b[s])) if s.sum() > ENOUGH else 0.0 for b, s in zip(brighter, still, strict=True)]
    )


def _smooth(values: np.ndarray, weight: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Mean nearby of what `values` (K,) are once divided by `weight` (K,)."""
    blurred = [cv2.GaussianBlur(v.reshape(shape), (0, 0), 2.0).ravel() for v in (values, weight)]
    return blurred[0] / np.maximum(blurred[1], 1e-3)


def _fitted(scene: _Scene, center: np.ndarray, pattern: np.ndarray) -> np.ndarray:
    """The best guess: centre x and y, log radius, log thickness over it, pull along the tissue (2) and out of it, tilt
    (2), matte."""
    best = []
    for lift in STARTS:
        start = np.array([*center, np.log(RADIUS), np.log(THICKNESS), 0, 0, 0, 0, 0, MATTE], float)
        nearest = np.argmin(((scene.rest[:, :2] - center) ** 2).sum(1))
        start[4:6] = _axes(scene.slope)[:2, :2] @ pattern[nearest]
        start[6] = np.tan(lift) * np.linalg.norm(start[4:6])
        best.append(_least_squares(lambda v: _misfit(scene, v, center), start, STEPS))
    return min(best, key=lambda found: found[0])[1]


def _moved(scene: _Scene, best: np.ndarray, share: float) -> tuple[np.ndarray, float]:
    """Displacement of the tissue in one frame, (K, 3), with all but the pull kept, and how far to believe it, 0-1.

    Wholly where the layer explains at least half of the motion across the view (its square), and less and less where it
    does not, as when the camera moves.
    """
    tissue, unit = _body(scene, best)
    whole = best[4:7]
    spread = np.hypot(STEADY * share, LOOSE) * np.linalg.norm(whole)

    def misfit(pull: np.ndarray) -> np.ndarray:
        data = _compared(scene, tissue, unit @ pull, best[9])
        return np.concatenate([data, (pull - share * whole) / spread, _beside_jaws(scene, best, pull)])

    moved = unit @ _least_squares(misfit, share * whole, STEPS[4:7])[1]
    left = scene.weight_across * np.linalg.norm(_across(scene, moved), axis=-1)
    seen = scene.weight_across * np.linalg.norm(scene.across, axis=-1)
    return moved, float(np.clip(2 - 2 * (left @ left) / max(seen @ seen, 1e-12), 0.0, 1.0))


def _body(scene: _Scene, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The tilted tissue (K, 3), and its displacement by each unit of pull (K, 3, 3)."""
    tissue, flat = scene.rest.copy(), scene.rest[:, :2]
    tissue[:, 2] += (flat - flat.mean(0)) @ v[7:9]
    axes = _axes(scene.slope + v[7:9])
    at = (tissue - _middle(scene, v)) @ axes[:2].T / np.exp(v[2])
    return tissue, axes.T @ scene.layer.carried(at, np.exp(v[3]))


def _middle(scene: _Scene, v: np.ndarray) -> np.ndarray:
    """The held ball's, on the tilted tissue, (3,)."""
    flat = scene.rest[:, :2]
    nearest = np.argmin(((flat - v[:2]) ** 2).sum(1))
    deep = scene.rest[nearest, 2] + (flat[nearest] - flat.mean(0)) @ v[7:9]
    return np.array([*v[:2], deep + (scene.slope + v[7:9]) @ (v[:2] - flat[nearest])])


def _beside_jaws(scene: _Scene, v: np.ndarray, pull: np.ndarray) -> np.ndarray:
    """Weighted differences, the held ball's way less its instrument's, (3,); 0 where that is unknown."""
    rest = _middle(scene, v)
    held = rest + _axes(scene.slope + v[7:9]).T @ pull
    gone = np.array([*(held[:2] / held[2] - rest[:2] / rest[2]), np.log(max(held[2] / rest[2], 0.2))])
    return _less_far(np.where(np.isfinite(scene.jaws), (gone - scene.jaws) * scene.weight_jaws, 0.0), ROBUST)


def _axes(slope: np.ndarray) -> np.ndarray:
    """Two directions along a plane of that slope, and the one out of it to the camera, (3, 3)."""
    out = np.array([*slope, -1.0]) / np.sqrt(1 + slope @ slope)
    right = np.array([1.0, 0.0, slope[0]]) / np.hypot(1.0, slope[0])
    return np.stack([right, np.cross(out, right), out])


def _misfit(scene: _Scene, v: np.ndarray, center: np.ndarray) -> np.ndarray:
    tissue, unit = _body(scene, v)
    lift = np.arctan2(v[6], np.linalg.norm(v[4:6]))
    expected = [
        *(v[:2] - center) / NEAR,
        (v[2] - np.log(RADIUS)) / RADIUS_SPREAD,
        (v[3] - np.log(THICKNESS)) / THICKNESS_SPREAD,
        (lift - LIFT) / LIFT_SPREAD,
        v[7] / TILT,
        v[8] / TILT,
        (v[9] - MATTE) / MATTE_SPREAD,
        *_beside_jaws(scene, v, v[4:7]),
    ]
    return np.concatenate([_compared(scene, tissue, unit @ v[4:7], v[9]), expected])


def _compared(scene: _Scene, tissue: np.ndarray, moved: np.ndarray, matte: float) -> np.ndarray:
    """Weighted differences, simulated less seen, of motion across the view and of brightness, (3 K,)."""
    across = _across(scene, moved)
    shape = scene.lattice.shape
    light = matte * (_brightness(tissue + moved, shape) - _brightness(tissue, shape)) - scene.brighter
    rest = np.concatenate([(across * scene.weight_across[:, None]).ravel(), light * scene.weight_light])
    return _less_far(rest, ROBUST / np.sqrt(ALIKE))


def _less_far(rest: np.ndarray, limit: float) -> np.ndarray:
    """Differences whose squares grow linearly beyond the limit."""
    far = np.abs(rest)
    return np.sign(rest) * np.sqrt(np.where(far < limit, far**2, 2 * limit * far - limit**2))


def _across(scene: _Scene, moved: np.ndarray) -> np.ndarray:
    """Simulated less seen motion across the view, (K, 2): (x, y, z) + u, seen along X, has u_x - X u_z = X z - x."""
    return moved[:, :2] - scene.ray * moved[:, 2:] - scene.across


def _brightness(points: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """log cos(theta) / d^2 of a surface of lattice points (K, 3), (K,)."""
    grid = points.reshape(*shape, 3)
    normal = np.cross(np.gradient(grid, axis=1), np.gradient(grid, axis=0))
    away = np.linalg.norm(grid, axis=-1)
    facing = np.abs((normal * grid).sum(-1)) / np.maximum(np.linalg.norm(normal, axis=-1) * away, 1e-12)
    return (np.log(np.maximum(facing, 0.05)) - 2 * np.log(away)).ravel()


def _least_squares(
    misfit: Callable[[np.ndarray], np.ndarray], start: np.ndarray, steps: np.ndarray
) -> tuple[float, np.ndarray]:
    """Least sum of squares and where, by Levenberg and Marquardt's method, derivatives taken over `steps`."""
    # scipy's steps are relative to the numbers, of which some are 0: too short for a field read off a grid.
    at, damping = start, 1e-2
    rest = misfit(at)
    for _ in range(25):
        slope = np.stack([misfit(at + step) - rest for step in np.diag(steps)], 1)
        square, before = slope.T @ slope, rest @ rest
        for _ in range(6):
            trial = at - steps * np.linalg.solve(square + damping * np.diag(np.diag(square)), slope.T @ rest)
            after = misfit(trial)
            if after @ after < before:
                at, rest, damping = trial, after, max(damping / 5, 1e-4)
                break
            damping *= 4
        if rest @ rest > (1 - 1e-3) * before:
            break
    return rest @ rest, at
