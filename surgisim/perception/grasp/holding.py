"""From when to when the tissue at an instrument's jaws goes where they go."""

import numpy as np

from surgisim.perception.grasp.following import WINDOW, Following

PARTED = 0.3
"""Agreement that speaks neither for nor against a grip: what is held strains, and lags behind the jaws."""
PLAIN = 0.004
"""A way that tells as much as agreement on it can, as a share of the longer image side."""
SOON = 8
"""Frames that jaws stand at tissue before they take it along."""
AWAY, QUICK, FALL = 0.9, 5, 0.6
"""Share of its way below which tissue is on its way back; frames in which what is let go springs back, and by how
much of its way at least."""
PARTLY = 0.5
"""Share of that which jaws that hold it go along."""
SWITCH = 2.5
"""Evidence it takes to believe that jaws have closed or opened."""


def held(follows: Following, side: int) -> list[tuple[int, int]]:
    """First and last frame of every stretch in which tissue is held.

    The likelier of two states, free and held, through all frames at once (Viterbi); a frame that shows nothing, as
    everything rests or the jaws are not seen, changes nothing.
    """
    evidence = np.where(np.isfinite(follows.agreement), follows.agreement - PARTED, 0.0)
    # What jaws push ahead of them goes along too, held or not.
    evidence = np.where(evidence > 0, evidence * np.clip((0.8 - follows.pushing) / 0.3, 0.0, 1.0), evidence)
    way = follows.way / (PLAIN * side)
    # Tissue that creeps by jaws at rest does not say that these have opened: only a clear motion does.
    evidence = evidence * np.where(evidence > 0, np.minimum(way, 3.0), np.clip(1.2 * (way - 1.0), 0.0, 3.0))
    state = _states(evidence)
    change = np.diff(np.concatenate([[0], state, [0]]))
    first, after = np.flatnonzero(change > 0), np.flatnonzero(change < 0)
    return [(int(a), int(b) - 1) for a, b in zip(first, after, strict=True)]


def _states(evidence: np.ndarray) -> np.ndarray:
    """0 or 1 for each frame, evidence (T,) being what a frame says for 1."""
    score, came = np.zeros(2), np.zeros((len(evidence), 2), int)
    for t, e in enumerate(evidence):
        # Of two histories as likely, tissue is taken later, and let go later: as far as can be seen it is still held.
        came[t] = [int(score[1] - SWITCH >= score[0]), int(score[1] > score[0] - SWITCH)]
        score = score[came[t]] - SWITCH * (came[t] != [0, 1]) + np.array([0.0, e])
    state = np.zeros(len(evidence), int)
    state[-1] = int(score[1] > score[0])
    for t in range(len(evidence) - 1, 0, -1):
        state[t - 1] = came[t][state[t]]
    return state


def began(follows: Following, first: int, side: int) -> int:
    """The frame in which the jaws came to stand at the tissue, `first` being the first that shows it go along."""
    speed = np.nan_to_num(np.linalg.norm(follows.jaws, axis=-1), nan=np.inf)
    earliest = max(first - WINDOW - 1, 0)
    rest = earliest + int(np.argmin(speed[earliest : first + 1]))
    earliest = max(rest - SOON, 0)
    still = speed < 0.002 * side
    while rest > 0 and still[rest - 1]:
        rest -= 1
    # Jaws that stand at the tissue from the first frame on hold it since then, for all that can be seen.
    return rest if rest == 0 else max(rest, earliest)


def let_go(follows: Following, last: int, frames: int) -> int:
    """The last frame before jaws and tissue part, `last` being the last one that shows them together."""
    if last >= frames - 2 - WINDOW:
        return frames - 1
    apart = np.linalg.norm(follows.tissue - follows.jaws, axis=-1)
    near = slice(max(last - WINDOW, 0), min(last + 2 * WINDOW + 1, frames - 1))
    part = apart[near]
    if not np.isfinite(part).any():
        return last
    sudden = np.nan_to_num(part, nan=-1.0)
    return near.start + int(np.argmax(sudden > 0.5 * sudden.max()))


def recoiled(course: np.ndarray, follows: Following, tip: np.ndarray, begin: int, end: int) -> int:
    """The last frame before tissue springs back without the jaws; `end` where it does not.

    course: where the tissue at the jaws is carried [px], (T, 2), held from `begin` to `end` as far as is known. tip:
    where the instrument ends [px], NaN where it is not seen, (T, 2).
    """
    share = _share(course, begin, end)
    last = begin + int(np.flatnonzero(share[begin : end + 1] >= AWAY)[-1])
    return last if springs_back(course, follows, tip, begin, last) else end


def springs_back(course: np.ndarray, follows: Following, tip: np.ndarray, begin: int, last: int) -> bool:
    """Whether tissue held from `begin` on goes back most of its way soon after `last`, and goes alone.

    Jaws open slowly, and stand or draw back near the place where tissue has left them: that it goes back alone says
    when. Tissue that rushes by drags the flow of the jaws along, an outline it does not; so either may say it.
    """
    share = _share(course, begin, last)
    after = min(last + QUICK, len(course) - 1)
    back, jaws = course[after] - course[last], follows.jaws[last:after]
    ways = [tip[after] - tip[last]]
    if np.isfinite(jaws).all(-1).any():
        # In a frame in which the jaws are not seen they go as in the others.
        ways.append((after - last) * np.nanmean(jaws, axis=0))
    alone = any(np.linalg.norm(back - way) > PARTLY * np.linalg.norm(back) for way in ways if np.isfinite(way).all())
    return bool(alone and share[last] - share[after] > FALL)


def _share(course: np.ndarray, begin: int, end: int) -> np.ndarray:
    """How far along the farthest way from `begin` to `end` tissue is in each frame, as a share of it, (T,)."""
    way = course - course[begin]
    top = begin + int(np.linalg.norm(way[begin : end + 1], axis=-1).argmax())
    return way @ way[top] / max(way[top] @ way[top], 1e-9)
