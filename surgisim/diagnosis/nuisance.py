"""What a residual may hold that is no tissue's physics: what a recording leaves open, and the simulator's own error.

Every kind is a group of directions, each at one prior standard deviation, that base and every law are fitted with. A
kind's columns come from the engine itself wherever it can say them, for the body at hand: a finer grid, a larger grip,
another place of it, another elastic law. None is read off one generator's recordings; the sizes below are what people
who grip, glue, film and track are taken to be able to do.
"""

from dataclasses import replace

import numpy as np
from scipy.linalg import solve_triangular

from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis import gripping, perceived
from surgisim.diagnosis.base import HELD, Base, by_held, displacement_gradient, tracks_of
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import plane
from surgisim.diagnosis.group import Group
from surgisim.diagnosis.memo import Memo
from surgisim.diagnosis.noise import Noise, whitener
from surgisim.diagnosis.ring_down import LATE, LATEST
from surgisim.estimation.trial import at_once
from surgisim.mpm.setup import widened
from surgisim.mpm.simulator import Breakdown
from surgisim.problem import Problem

LAG = 0.02
"""Standard deviation of the tracker's lag [s]: half a frame at 25 Hz."""
SCALE = 0.03
"""Of the scale along each axis [1]: a focal length or a depth is known to some per cent."""
DRIFT, DRIFT_SPREAD = 1.5e-4, 1.0
"""Median and spread (logarithm) of how far a camera drifts over a clip [m], before its rest has been looked at."""
DRIFTS = np.geomspace(2e-5, 3e-3, 16)
"""Sizes that are weighed [m]."""
WALKS = 16
"""Courses of a drift: the first of a random walk's (Karhunen and Loeve), which leave 1 % of its mean square. A camera
does not only glide: with three courses, walks of .6 and 1.1 mm were taken for a weight that sets in. That, and that
PARTS have sizes of their own, was chosen after recordings of one other solver (docs/diagnosis.md, "A camera that
walks")."""
PARTS = (1, 2, 1)
"""Patterns over the tissue of a drift's parts, each of a size of its own: all of the picture, its gradients, and what
is bilinear."""
ASCENTS = 3
"""How often each part's size is weighed beside the others'."""
LEAST_REST = 6
"""Frames of rest from which a drift is learned."""
PLACE, SLIGHT, MOST_PLACES = 1.0, 1.0, 150
"""Where a point sits on the body, over the noise of a frame: what a tracker has constantly wrong, no averaging takes
off, and a mesh moves each point a little otherwise than tissue does. Directions are left out where a standard deviation
is worth less chi square than SLIGHT, and beyond the first MOST_PLACES."""
RADIUS, HERE, CENTRE = 0.1, 1.0, 5e-4
"""Of a grip's radius, and again of all grips' alike [1]; of a factor of that which varies over the tissue [1]; of a
grip's centre [m]."""
SOON = 0.2
"""Of the moment of a release whose frames were fitted, about what came out [frames]: there tracks bend with it."""
LAWS = ("corotated", "neo_hookean")
"""Elastic laws that tissue may follow instead of the base's; a standard deviation is the whole way to each."""
FAR_OFF = 0.8e-3
"""Beyond which what is held is laid anew [m]."""
FINER = 0.79
"""Spacing of the finer grid that tells the simulator's error, over that of the search."""
WHOLE, APART, BENT, ASKEW = 0.5, 0.5, 0.5, 0.3
"""Of what is left of the simulator's error over the difference that a finer grid makes beside stiffer numbers
(`Clip.error`), once that is taken off: of all of it, of what tissue does while held and after apart, of a factor that
varies over the tissue, and of what points elsewhere. Together about as large as that difference: of three recordings
that conceal nothing, at their true numbers, .8, 1.0 and 1.4 of it is left while held and .8, .8 and 1.4 once let go."""
ALIKE = 1.4
"""Distance over which such a factor is alike, in cells."""
PATTERNS = 14


def of_base(
    clip: Clip, simulated: np.ndarray, error: np.ndarray, gradient: np.ndarray, drift: np.ndarray, noise: Noise,
    settings: Diagnosing,
) -> list[Group]:  # fmt: skip
    """What a base is fitted with.

    error: what a finer grid changes [m], (K, T, 3); gradient: displacement's [1], (3, K, T, 3); drift: sizes of its
    parts [m], (3,).
    """
    groups = [*camera(clip, simulated), drifting(clip, drift), places(clip, gradient, noise)]
    groups += [*perceived.groups(clip, simulated, noise), simulator(clip, error, settings.model_error)]
    return chosen(groups, settings)


def of_laws(
    clip: Clip, base: Base, drift: np.ndarray, noise: Noise, settings: Diagnosing, others: list[Group]
) -> list[Group]:
    """What laws are fitted with: the same, and grips, held tissue and elastic laws that may be others.

    others: `other_bodies` near this base.
    """
    near = base.tangent
    groups = [*others, *gripping.groups(clip, near), perceived.edge(clip, near)]
    gradient = displacement_gradient(base.prepared, clip, base.run)
    error = np.zeros_like(base.simulated) if clip.error is None else clip.error
    return of_base(clip, base.simulated, error, gradient, drift, noise, settings) + chosen(groups, settings)


def chosen(groups: list[Group], settings: Diagnosing) -> list[Group]:
    """Those that are not left out, and that act."""
    return [g for g in groups if g.name not in settings.without and len(g.columns)]


def span(groups: list[Group], name: str) -> slice:
    """Where the columns of a group stand among all groups' columns; empty where it is left out."""
    at = 0
    for group in groups:
        if group.name == name:
            return slice(at, at + len(group.columns))
        at += len(group.columns)
    return slice(at, at)


def likely_held(groups: list[Group], likely: np.ndarray) -> float:
    """How far beyond its box what is held seems to end [m]; likely: of all columns, the groups' first, (M,)."""
    mine = span(groups, "held")
    return sum(g.values[0][1] * float(likely[mine.start]) for g in groups if g.name == "held")


def positions(groups: list[Group], names: set[str]) -> list[int]:
    """Where the columns of these values stand among all groups' columns."""
    found, at = [], 0
    for group in groups:
        found += [at + n for n, (name, *_) in enumerate(group.values) if name in names]
        at += len(group.columns)
    return found


def camera(clip: Clip, simulated: np.ndarray) -> list[Group]:
    """A tracker's lag and scales along three axes."""
    velocity = np.gradient(simulated, axis=1) * clip.fps
    scales = np.stack([SCALE * simulated * e for e in np.eye(3)])
    named = tuple((f"scale along {a}", SCALE, "1") for a in "xyz")
    return [Group("lag", LAG * velocity[None], (("tracker lag", LAG, "s"),)), Group("scale", scales, named)]


def places(clip: Clip, gradient: np.ndarray, noise: Noise) -> Group:
    """Where points sit on the body: tissue beside them moves otherwise.

    gradient: displacement's at the points [1], (3, K, T, 3).
    """
    sigma = noise.each
    found = []
    for k, slope in enumerate(np.moveaxis(gradient, 1, 0)):
        seen = slope[:, clip.seen[k]].reshape(3, -1)
        worth, ways = np.linalg.eigh(PLACE**2 * seen @ seen.T)
        found += [(w, k, PLACE * sigma[k] * np.tensordot(way, slope, 1)) for w, way in zip(worth, ways.T, strict=True)]
    found = sorted((one for one in found if one[0] > SLIGHT), key=lambda one: -one[0])[:MOST_PLACES]
    columns = np.zeros((len(found), *gradient.shape[1:]))
    for column, (_, k, moved) in zip(columns, found, strict=True):
        column[k] = moved
    return Group("place", columns)


def drifting(clip: Clip, sizes: np.ndarray, frames: int | None = None) -> Group:
    """Slow motions of the camera, whose parts (PARTS) move the picture by about `sizes` [m], (3,), until the end."""
    frames = frames or clip.frames
    flat = (clip.rest - clip.rest.mean(0)) @ plane(clip).T
    u, v = (flat / np.maximum(np.sqrt((flat**2).mean(0)), 1e-9)).T
    patterns = np.stack([np.ones_like(u), u, v, u * v])
    k = np.arange(1, WALKS + 1)[:, None] - 0.5
    time = np.arange(frames) / max(clip.frames - 1, 1)
    courses = np.sqrt(2) * np.sin(k * np.pi * time) / (k * np.pi)
    field = np.einsum("pk,ct,ai->packti", patterns, courses, np.eye(3)).reshape(-1, len(clip.rest), frames, 3)
    return Group("drift", field).wider(by_part(sizes))


def by_part(sizes: np.ndarray) -> np.ndarray:
    """What holds for each part of a drift, (3,), for each of its directions, (C,)."""
    return np.repeat(sizes, [3 * WALKS * patterns for patterns in PARTS])


def drift_prior(size: np.ndarray) -> np.ndarray:
    """log density of how far one part of a drift goes over a clip [m], but for a constant."""
    return -0.5 * (np.log(size / DRIFT) / DRIFT_SPREAD) ** 2


def drift_of(clip: Clip, noise: Noise, offsets: bool) -> np.ndarray:
    """How far the camera drifts over a clip [m], (3,), as the rest before the first grasp tells: geometric mean.

    What tissue does once it is gripped says more of it (`Case.likeliest_drift`), but may be what a law does.
    """
    busy = clip.motion.active.any(0) if len(clip.motion.active) else np.ones(clip.frames, bool)
    rest = min(int(busy.argmax()) if busy.any() else clip.frames, clip.until)
    sizes = np.full(len(PARTS), DRIFT)
    directions = len(by_part(sizes))
    gram, shadow = np.zeros((directions, directions)), np.zeros(directions)
    if rest >= LEAST_REST:
        seen = clip.seen[:, :rest]
        mine = seen.any(1)
        whiten = whitener(noise.of(mine), clip.rest[mine], seen[mine], offsets)
        z = whiten(clip.moved[mine, :rest])
        U = whiten(drifting(clip, np.ones(len(PARTS)), rest).columns[:, mine]).T
        gram, shadow = U.T @ U, U.T @ z
    for _ in range(ASCENTS):
        for part in range(len(PARTS)):
            log = np.zeros(len(DRIFTS))
            for n, size in enumerate(DRIFTS):
                sizes[part] = size
                log[n] = drift_prior(size) + likelihood(gram, shadow, by_part(sizes))
            weight = np.exp(log - log.max())
            sizes[part] = np.exp((weight * np.log(DRIFTS)).sum() / weight.sum())
    return sizes


def likelihood(gram: np.ndarray, shadow: np.ndarray, wide: np.ndarray) -> float:
    """log likelihood of a whitened residual z beside directions U, each of prior standard deviation `wide`, (M,), but
    for what does not depend on it. gram: U^T U, (M, M); shadow: U^T z, (M,)."""
    factor = np.linalg.cholesky(np.eye(len(wide)) + wide[:, None] * gram * wide)
    half = solve_triangular(factor, wide * shadow, lower=True)
    return float(0.5 * (half**2).sum() - np.log(np.diag(factor)).sum())


def simulator(clip: Clip, error: np.ndarray, share: float = 1.0) -> Group:
    """The simulator's own error, known by what a finer grid changes [m], (K, T, 3): like it, and of its size.

    share: times what is expected.
    """
    if not error.any() or share == 0:
        return Group("simulator", np.zeros((0, *error.shape)))
    error = share * error
    alike, patterns = _factors(clip)
    held_then = clip.held
    spans = [span for span in (held_then, ~held_then) if (error * span[None, :, None]).any()]
    result = [WHOLE * error, *(APART * error * span[None, :, None] for span in spans)]
    result += [BENT * error * p[:, None, None] for p in patterns]
    result += _askew(error, spans, alike, patterns)
    return Group("simulator", np.stack(result))


def _factors(clip: Clip) -> tuple[np.ndarray, np.ndarray]:
    """How alike a factor is at two points, (K, K), and its patterns, of unit variance at a point, (M, K)."""
    apart = np.linalg.norm(clip.rest[:, None] - clip.rest[None], axis=-1)
    alike = np.exp(-0.5 * (apart / (ALIKE * clip.body.spacing)) ** 2)
    values, axes = np.linalg.eigh(alike)
    order = np.argsort(values)[::-1][:PATTERNS]
    return alike, (axes[:, order] * np.sqrt(np.maximum(values[order], 0))).T


def _askew(error: np.ndarray, spans: list[np.ndarray], alike: np.ndarray, patterns: np.ndarray) -> list[np.ndarray]:
    """What is as large as an error [m], (K, T, 3), in frames `spans`, (T,) each, and points anywhere."""
    near, result = alike / alike.sum(1, keepdims=True), []
    for span in spans:
        square = (error**2).sum(-1) / 3 * span
        size = np.sqrt(near @ square.mean(1) * len(span) / span.sum())
        course = np.sqrt(square.mean(0) / max(square.mean(0)[span].mean(), 1e-30))
        result += [ASKEW * (p * size)[:, None, None] * course[None, :, None] * e for p in patterns for e in np.eye(3)]
    return result


def other_bodies(clip: Clip, base: Base, memo: Memo, workers: int) -> list[Group]:
    """Grips of another size or place, or that open sooner, tissue of another elastic law, and what is held ending
    elsewhere, by the engine."""
    motion, wide, trials = clip.motion, widened(clip.motion.radius, clip.body.spacing), []
    u, v = plane(clip)
    for j in range(len(motion.radius)):
        if not motion.active[j].any():
            continue
        one = np.eye(len(motion.radius))[j]
        shown = motion.active[j, : clip.until].any()
        larger = replace(motion, radius=wide * (1 + RADIUS * one))
        # A ball that the grid widens is wrong by that too.
        sd = float(np.hypot(RADIUS, wide[j] / motion.radius[j] - 1))
        trials.append(("grip radius", (f"radius of grip {j}", sd, "1"), larger, sd / RADIUS))
        for axis, way in (("u", u), ("v", v)) if shown else ():
            by = CENTRE * one[:, None] * way
            aside = replace(motion, center_rest=motion.center_rest + by, position=motion.position + by[:, None])
            trials.append(("grip centre", (f"centre of grip {j} along {axis}", CENTRE, "m"), aside, 1.0))
    for j in np.flatnonzero(motion.active.any(1) & ~motion.active[:, : clip.until].any(1)):
        # Of grips that fitted frames show, the tangent says it (`firmness`).
        way = np.eye(len(motion.radius))[j][:, None, None] * (motion.position - motion.center_rest[:, None])
        further = replace(motion, position=motion.position + gripping.FIRM * way)
        trials.append(("grip firmness", (f"firmness of grip {j}", gripping.FIRM, "1"), further, 1.0))
    trials = [
        (name, told, replace(clip, recording=replace(clip.recording, motion=m)), None, times)
        for name, told, m, times in trials
    ]
    trials += [("elastic law", (name, 1.0, "1"), clip, (name, "newtonian"), 1.0) for name in LAWS]
    for j, last in clip.releases(clip.frames - 1):
        known = last < clip.until - 3
        sd, by = (SOON if known else LATE), (-0.25 if clip.opening[j, last] > LATEST - 0.25 else 0.25)
        late = clip.opening.copy()
        late[j, last] += by
        when = (release(j, last), sd / clip.fps, "s")
        trials.append(("release", when, replace(clip, late=late), None, sd / by))

    def moved(run, _worker: int) -> np.ndarray | None:
        _, _, other, terms, times = run
        try:
            return times * (tracks_of(other, base.x, memo, terms or base.prepared.terms) - base.simulated)
        except (Breakdown, Problem):
            return None

    groups: dict[str, Group] = {}
    for (name, told, *_), change in zip(trials, at_once(moved, trials, workers), strict=True):
        if change is not None:
            before = groups.get(name, Group(name, np.zeros((0, *change.shape))))
            groups[name] = Group(name, np.concatenate([before.columns, change[None]]), (*before.values, told))
    if "grip radius" in groups:
        groups["grip radius"] = _of_one_instrument(_here_and_there(clip, groups["grip radius"]))
    held = HELD * by_held(clip, base.x, base.simulated, memo)
    if held.any():
        groups["held"] = Group("held", held[None], (("where what is held ends", HELD, "m"),))
    return list(groups.values())


def release(grip: int, last: int) -> str:
    """What the moment is called at which a grip opens, after the last frame in which it holds."""
    return f"release of grip {grip} after frame {last}"


def _here_and_there(clip: Clip, radius: Group) -> Group:
    """Grips larger here and smaller there, which moves tissue farther here than there: no tissue is as uniform, nor any
    mesh of it, as a base."""
    (alike, patterns), columns = _factors(clip), [radius.columns]
    shown = {f"radius of grip {j}" for j, on in enumerate(clip.motion.active) if on[: clip.until].any()}
    for one, (name, *_) in zip(radius.columns, radius.values, strict=True):
        if name in shown:
            columns.append(HERE * one * patterns[:, :, None, None])
            columns.append(np.stack(_askew(HERE / ASKEW / 2 * one, [np.ones(clip.frames, bool)], alike, patterns)))
    return replace(radius, columns=np.concatenate(columns))


def _of_one_instrument(radius: Group) -> Group:
    """Grips that are all larger, or all smaller, than said: the same jaws, measured or meshed the same way."""
    if len(radius.values) < 2:
        return radius
    each = [RADIUS / sd * one for one, (_, sd, _) in zip(radius.columns, radius.values, strict=False)]
    # Last, since `values` names the first columns.
    return replace(radius, columns=np.concatenate([radius.columns, sum(each)[None]]))
