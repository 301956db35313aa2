"""Instruments followed through a clip from what was clicked: in one frame, once for each of them.

Where a thing is in the next frame is told by places that look like it (remembering.py) and by what colour_motion found;
SAM 2 draws outlines from points there, and the one that agrees best with both is taken and remembered.
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from surgisim.config.masking import Click
from surgisim.perception.masking.drawing import Drawer, Embedded, Point, inner_points, overlap
from surgisim.perception.masking.remembering import Asked, Remembered, belief, remember

LAST = 3
"""Frames remembered beside those that were clicked."""
POINTS = 3
"""Points shown to the network of what it is to draw."""
LEAST = 0.0004
"""Share of the frame below which nothing is there to be drawn."""
AGREE = 0.4
"""Overlap with where it is thought to be from which an outline is believed in frames that were not clicked."""
SURE = 0.5
"""What the network's own estimate counts beside the overlap."""


@dataclass
class Thing:
    """One instrument."""

    shown: list[Remembered] = field(default_factory=list)
    """Where it was clicked."""
    last: deque[Remembered] = field(default_factory=lambda: deque(maxlen=LAST))
    masks: dict[int, np.ndarray] = field(default_factory=dict)
    """By frame, (H, W) bool."""
    sure: dict[int, float] = field(default_factory=dict)


def followed(
    rgb: np.ndarray, rough: np.ndarray, clicks: Sequence[Click], drawer: Drawer, progress: Callable[[float], None]
) -> tuple[np.ndarray, np.ndarray]:
    """Instrument pixels (T, H, W) bool, and the mean of the network's estimates (T,), 0 where nothing is.

    rough: what colour_motion found, (T, H, W) bool. progress is told the share that is done.
    """
    clicked = sorted({c.frame for c in clicks if c.label == "tool"})
    things: list[Thing] = []
    onward, back = range(clicked[0], len(rgb)), range(clicked[-1] - 1, -1, -1)
    for way in (onward, back):
        for thing in things:
            thing.last.clear()
        for t in way:
            if way is back and all(t in thing.masks for thing in things):
                continue
            here = [c for c in clicks if c.frame == t and (way is onward or c.label == "tissue")]
            _draw(things, t, drawer.embedded(rgb[t]), rough[t], here, drawer)
            progress(((t - onward.start) if way is onward else len(rgb) - 1 - t) / len(rgb))
    masks, sure = np.zeros(rough.shape, bool), np.zeros(len(rgb))
    for t in range(len(rgb)):
        masks[t] = np.any([thing.masks[t] for thing in things], axis=0)
        estimates = [thing.sure[t] for thing in things if thing.masks[t].any()]
        sure[t] = np.mean(estimates) if estimates else 0.0
    return masks, sure


def _draw(things, t: int, frame: Embedded, rough: np.ndarray, clicks: Sequence[Click], drawer: Drawer) -> None:
    """Masks of every thing in frame t; what is clicked and is none of them yet becomes one."""
    places = frame.places
    known = [thing for thing in things if t not in thing.masks]
    asked: Asked = {}
    likely = [belief(places, [*thing.shown, *thing.last], frame.size, asked) for thing in known]
    marked: list[list[Point]] = [[] for _ in known]
    tissue = [(c.x, c.y, 0) for c in clicks if c.label == "tissue"]
    for click in (c for c in clicks if c.label == "tool"):
        at = round(click.y), round(click.x)
        owner = int(np.argmax([each[at] for each in likely])) if likely else -1
        if owner >= 0 and likely[owner][at] > 0.5:
            marked[owner].append((click.x, click.y, 1))
        else:
            things.append(Thing())
            known.append(things[-1])
            likely.append(np.zeros(frame.size, np.float32))
            marked.append([(click.x, click.y, 1)])
    inner = [inner_points(each > 0.5, POINTS) for each in likely]
    for k, thing in enumerate(known):
        others = [(x, y, 0) for j, each in enumerate(inner) if j != k for x, y in each[:1]]
        others += [(x, y, 0) for j, each in enumerate(marked) if j != k for x, y, _ in each]
        mask, sure = _best(frame, likely[k], rough, [*marked[k], *tissue], others, drawer)
        thing.masks[t], thing.sure[t] = mask, sure
        if mask.any():
            remembered = remember(places, mask, everywhere=bool(marked[k]))
            (thing.shown if marked[k] else thing.last).append(remembered)


def _best(
    frame: Embedded,
    likely: np.ndarray,
    rough: np.ndarray,
    clicked: list[Point],
    others: list[Point],
    drawer: Drawer,
) -> tuple[np.ndarray, float]:
    """The outline that agrees best with where a thing is likely to be, and how sure the network is of it.

    clicked: of this thing and of tissue. others: what other things are shown by.
    """
    guess = likely > 0.5
    shown = [at for at in clicked if at[2] == 1]
    if not shown and guess.sum() < LEAST * guess.size:
        return np.zeros_like(guess), 0.0
    coloured = _its_own(rough, guess, shown)
    ideas = [each for each in (guess, coloured) if each.any()]
    answers = []
    for idea, hint in ((guess, np.clip(likely, 0, 1)), (coloured, coloured)):
        if idea.any():
            points = [*clicked, *((x, y, 1) for x, y in inner_points(idea, POINTS)), *others]
            answers += drawer.drawn(frame, points, hint) + drawer.drawn(frame, points, None)
    if not ideas:
        answers = drawer.drawn(frame, [*clicked, *others], None)
    answers = [each for each in answers if _keeps(each[0], clicked)] or answers
    agree = [float(np.mean([overlap(mask, idea) for idea in ideas])) if ideas else 0.0 for mask, _ in answers]
    best = int(np.argmax([a + SURE * sure for a, (_, sure) in zip(agree, answers, strict=True)]))
    if ideas and agree[best] < AGREE and not clicked:
        return (guess if guess.any() else coloured), 0.5
    return answers[best]


def _keeps(mask: np.ndarray, clicked: list[Point]) -> bool:
    """Whether an outline has inside and outside what was clicked as such."""
    return all(mask[round(y), round(x)] == (label == 1) for x, y, label in clicked)


def _its_own(rough: np.ndarray, guess: np.ndarray, marked: list[Point]) -> np.ndarray:
    """Those regions of colour_motion's that are clicked, lie mostly where it is thought to be, or are most of it."""
    number, label = cv2.connectedComponents(rough.astype(np.uint8), connectivity=8)
    area = np.bincount(label.ravel(), minlength=number)
    common = np.bincount(label[guess], minlength=number)
    kept = (common > 0.5 * area) | (common > 0.5 * guess.sum())
    for x, y, _ in marked:
        kept[label[round(y), round(x)]] = True
    kept[0] = False
    return kept[label]
