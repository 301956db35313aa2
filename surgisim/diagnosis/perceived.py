"""What a residual may hold because body, grips and tracks were read off a video, as groups of directions (nuisance.py).

A recording of a video says so itself: by `doubts`, what body and grips were taken to be, and by `astray`, how far
tracks are off where tissue has gone somewhere. One that was measured has neither.
"""

import numpy as np

from surgisim.diagnosis.clip import Clip, along, pull_of
from surgisim.diagnosis.group import Group, none
from surgisim.diagnosis.noise import Noise
from surgisim.diagnosis.tangent import Tangent
from surgisim.estimation.model_error import LEAST, alike

SHAPE, BENT = 0.3, 0.1
"""Of how far tissue is carried, how far that is off in a pull, and how far it is off halfway beyond half of that:
standard deviations."""
ROUGH, NEAR = 0.5, 0.003
"""Share of that which is a place's own, and over what distance that is alike [m]; the rest goes as far as what an
estimation takes a field to be alike over."""
SWING, CHANGES = 0.5, 0.03
"""Of the geometric mean of how far tissue was pulled and how far it still swings, how far its swing is off, and over
what time that is alike [s]: parts of a body that was guessed swing at paces of their own, so that what is right at
first is not for long."""
LEFT = 0.3
"""How far a track is still off once its point is back, as a share of how far it was off when that was farthest: of nine
clips of family 27182 .007 to .019 of the way, beside .03 to .07 on it."""
WALKS = 4
"""Courses of a track's error over how far its point has gone, the first of a random walk's (Karhunen and Loeve): a
track gathers it on its way, and has about what it had in a place when it is there again."""
JUMPS, LIKELY, ASIDE = 4.0, 0.5, 1.5
"""How far a track must step aside from the middle one of its neighbours to have jumped: times what the middle point
does, at least as a share of its noise, and times what the neighbours do."""
BESIDE, MOST_JUMPS = 8, 200
"""Neighbours of a point, and jumps that are counted at most, the largest first."""
FAINT = 0.1
"""Where tissue hardly moves, what a guessed body gets wrong is as large as where it goes this share of the farthest."""
WIDE = 1.5
"""Radii of a patch of the picture's edge within which points say what a push there does; chosen."""
SLIGHT, MOST = 1.0, 400
"""Directions are left out where a standard deviation is worth less chi square than that, and beyond the first ones."""


OF_TRACKS = ("astray", "jumps")
"""Groups of single tracks' errors."""
BY_VIDEO = ("perception", "shape", "swing", "edge", *OF_TRACKS)
"""All groups."""


def groups(clip: Clip, simulated: np.ndarray, noise: Noise) -> list[Group]:
    """All of them; simulated: displacement of the points by the base [m], (K, T, 3)."""
    body = [doubted(clip), shape(clip, simulated, noise), swing(clip, simulated, noise)]
    return [*body, astray(clip, noise), jumps(clip, noise)]


def doubted(clip: Clip) -> Group:
    """What the body and the grips were taken to be, as far as the recording says how sure of that it is."""
    doubts = clip.recording.of(clip.kept).doubts
    columns = np.stack(list(doubts.values())) if doubts else np.zeros((0, *clip.moved.shape))
    return Group("perception", columns, tuple((name, 1.0, "standard deviations") for name in doubts))


def shape(clip: Clip, simulated: np.ndarray, noise: Noise) -> Group:
    """What a guessed body gets wrong in a pull: each place is carried farther or less far, in proportion to the pull,
    and by somewhat more or less than that halfway."""
    if not clip.recording.doubts:
        return none("shape", simulated)
    far, course = _carried(clip, simulated, noise)
    courses = clip.held * np.stack([SHAPE * course, BENT * 4 * course * (1 - course)])
    return Group("shape", _fields(clip, far, courses, noise))


def swing(clip: Clip, simulated: np.ndarray, noise: Noise) -> Group:
    """How a guessed body swings otherwise once it is let go."""
    begins = [last + 1 for _, last in clip.releases(clip.frames - 1)]
    if not clip.recording.doubts or not begins:
        return none("swing", simulated)
    far, course = _carried(clip, simulated, noise)
    free = ~clip.held & (np.arange(clip.frames) >= min(begins))
    # How far it still swings: the farthest that is to come, until it is taken hold of again.
    still, farthest = np.zeros(clip.frames), 0.0
    for t in reversed(range(clip.frames)):
        farthest = max(farthest, abs(course[t])) if free[t] else 0.0
        still[t] = farthest
    apart = np.abs(clip.time[:, None] - clip.time) / CHANGES
    value, vector = np.linalg.eigh(np.sqrt(still)[:, None] * np.exp(-apart) * np.sqrt(still))
    kept = value > LEAST * value[-1]
    return Group("swing", _fields(clip, far, SWING * (vector[:, kept] * np.sqrt(value[kept])).T, noise))


def edge(clip: Clip, near: Tangent) -> Group:
    """Tissue beyond the picture that goes along with a pull, as a load at each patch of the edge in proportion to it.

    What the edge does before tissue is touched, or once it is let go, is none of that. near: tangent of the base.
    """
    until = clip.until
    if clip.edge is None or not clip.held[:until].any():
        return none("edge", clip.moved)
    course = pull_of(clip.motion)
    size = np.sqrt((along(course, clip.edge.position, until) ** 2).sum(1).mean() / 2)
    rest, columns = clip.body.rest.astype(float), []
    for place, radius in zip(clip.edge.position[:, 0], clip.edge.radius, strict=True):
        mine = np.exp(-0.5 * (np.linalg.norm(rest - place, axis=1) / radius) ** 2) * ~clip.body.held
        if mine.sum() < 1e-6:
            continue
        loads = near.of_push(mine[None, :, None] * np.eye(3)[:, None])
        states = near.at_states(np.broadcast_to(loads, (len(near.frames), *loads.shape)))
        here = np.linalg.norm(clip.rest - place, axis=1)
        beside = here <= max(WIDE * radius, here.min())
        for d in range(3):
            column = np.zeros_like(clip.moved)
            column[:, :until] = near.over_time(states[:, d], course[:until])
            reach = np.linalg.norm(column[beside], axis=-1).max()
            if reach > 0:
                columns.append(size / reach * column)
    return Group("edge", np.stack(columns)) if columns else none("edge", clip.moved)


def astray(clip: Clip, noise: Noise) -> Group:
    """Tracks of points that have gone somewhere: each off by a share of its way, and still by some once it is back."""
    share, moved = clip.recording.astray, noise.told_of(clip.moved)
    if not share:
        return none("astray", moved)
    far, frame = np.linalg.norm(moved, axis=-1), np.arange(clip.frames)
    # Every point that is kept is seen in some of the fitted frames.
    gone = np.stack([np.interp(frame, frame[s], f[s]) for f, s in zip(far, clip.seen, strict=True)])
    farthest = gone.max(1, keepdims=True)
    k = np.arange(1, WALKS + 1)[:, None, None] - 0.5
    walks = farthest * np.sqrt(2) * np.sin(k * np.pi * gone / np.maximum(farthest, 1e-12)) / (k * np.pi)
    each = np.concatenate([walks, LEFT * (np.maximum.accumulate(gone, axis=1) - gone)[None]])
    ways = _ways(clip)
    worth = np.stack([_worth(share * e[..., None] * way[:, None], clip, noise) for e in each for way in ways])
    order = np.argsort(worth, axis=None)[::-1][:MOST]
    columns = []
    for index in order[worth.flat[order] > SLIGHT]:
        which, k = np.unravel_index(index, worth.shape)
        column = np.zeros_like(moved)
        column[k] = share * each[which // len(ways), k][:, None] * ways[which % len(ways)][k]
        columns.append(column)
    return Group("astray", np.stack(columns)) if columns else none("astray", moved)


def jumps(clip: Clip, noise: Noise) -> Group:
    """Tracks that step aside from their neighbours', and stay there: each has a constant of its own from there on."""
    near = np.argsort(np.linalg.norm(clip.rest[:, None] - clip.rest[None], axis=-1), axis=1)[:, 1 : BESIDE + 1]
    if not clip.recording.astray or near.shape[1] < BESIDE:
        return none("jumps", clip.moved)
    ways, frame = np.stack(_ways(clip), 1), np.arange(clip.frames)
    along = np.einsum("kwa,kta->kwt", ways, clip.moved) / noise.surest[:, None, None]
    path = np.array([[np.interp(frame, frame[s], a[s]) for a in p] for p, s in zip(along, clip.seen, strict=True)])
    step = np.diff(path, axis=-1)
    beside = np.median(step[near], axis=1)
    own, theirs = np.linalg.norm(step - beside, axis=1), np.linalg.norm(beside, axis=1)
    # Tissue that is dragged along by less than its neighbours has not jumped.
    large = own > np.maximum(JUMPS * np.maximum(np.median(own, axis=0), LIKELY), ASIDE * theirs)
    columns = []
    for k, t in sorted(zip(*np.nonzero(large), strict=True), key=lambda at: -own[at])[:MOST_JUMPS]:
        for way in ways[k]:
            column = np.zeros_like(clip.moved)
            column[k, t + 1 :] = own[k, t] * noise.surest[k] * way
            columns.append(column)
    return Group("jumps", np.stack(columns)) if columns else none("jumps", clip.moved)


def _carried(clip: Clip, simulated: np.ndarray, noise: Noise) -> tuple[np.ndarray, np.ndarray]:
    """How far each point is carried at most [m], (K,), and which share of that all are in every frame, (T,)."""
    told = noise.told_of(simulated)
    top = int(np.linalg.norm(told[:, : clip.until], axis=-1).mean(0).argmax())
    most = told[:, top]
    far = np.linalg.norm(most, axis=-1)
    course = np.einsum("kta,ka->t", told, most) / max((most**2).sum(), 1e-12)
    return np.maximum(far, FAINT * np.percentile(far, 99)), course


def _fields(clip: Clip, far: np.ndarray, courses: np.ndarray, noise: Noise) -> np.ndarray:
    """Fields in space with each course in time (N, T), along every direction that can be told, at one standard
    deviation [m], (C, K, T, 3), where points are carried `far` [m], (K,)."""
    apart = np.linalg.norm(clip.rest[:, None] - clip.rest[None], axis=-1)
    kernel = (1 - ROUGH) * alike(clip.rest, far) + ROUGH * np.exp(-0.5 * (apart / NEAR) ** 2)
    value, vector = np.linalg.eigh(far[:, None] * kernel * far)
    modes = vector * np.sqrt(np.maximum(value, 0.0))
    ways, each = np.stack(_ways(clip)), []
    sigma = noise.each
    weight = clip.seen[:, : clip.until] / sigma[:, None] ** 2
    worth = np.einsum("kq,nt,kt->nq", modes**2, courses[:, : clip.until] ** 2, weight)
    order = np.argsort(worth, axis=None)[::-1][: MOST // len(ways)]
    for index in order[worth.flat[order] > SLIGHT]:
        n, q = np.unravel_index(index, worth.shape)
        each += [modes[:, q, None, None] * courses[n][None, :, None] * way[:, None] for way in ways]
    return np.stack(each) if each else np.zeros((0, *clip.moved.shape))


def _ways(clip: Clip) -> list[np.ndarray]:
    """Directions of which the recording is surest, (K, 3) each: two across the view, or x, y and z."""
    mine = clip.recording.of(clip.kept)
    if mine.ways is None:
        return list(np.broadcast_to(np.eye(3)[:, None], (3, len(clip.rest), 3)))
    return [mine.ways[:, a] for a in range(2)]


def _worth(column: np.ndarray, clip: Clip, noise: Noise) -> np.ndarray:
    """Chi square of a direction [m], (..., K, T, 3), in the fitted frames, by point, (..., K)."""
    sigma = noise.each
    until = clip.until
    return ((column[..., :until, :] ** 2).sum(-1) * clip.seen[:, :until]).sum(-1) / sigma**2
