"""Courses in time in which a residual force or stress is tried, and what a fit may turn about one.

All are functions that go on after the last fitted frame (physics/course.py): what comes and stays, grows all along,
fades, ends, or comes again and again.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from surgisim.diagnosis import knobs
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import hats, knots
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.physics.course import LASTING, NEVER, at

KNOT = 0.2
"""Time between the knots of the courses in a coarse search [s]; around its best, courses are followed exactly."""
MOMENT = 0.2
"""Time between moments at which something sets in [s]."""
RISES, FADES, LASTS = (0.12, 0.5, 1.2), (0.4, 1.2), (0.5, 1.0, 2.0)
"""How long it takes to come, to fade and until it ends [s]."""
PERIODS, PHASES = (0.8, 1.25, 2.0, 3.0, 4.5), tuple(np.arange(4) * np.pi / 4)
"""Of what is periodic [s], [rad]; a phase beyond half a turn is the opposite sign."""
BEFORE = -1e2
"""Onset of what has been there all along [s]."""
GROWS = 2.0
"""Rise of what grows all along, over the length of the fitted frames."""


@dataclass(frozen=True)
class Course:
    onset: float
    rise: float = RISES[0]
    end: float | None = None
    fade: float = LASTING
    rhythm: float = 0.0
    period: float = 2.0
    phase: float = 0.0

    @property
    def numbers(self) -> dict[str, float]:
        """As a law's parameters."""
        return {**vars(self), "end": NEVER if self.end is None else self.end}

    def on(self, time: np.ndarray) -> np.ndarray:
        """c at some times [s]."""
        return at(time, **self.numbers)

    @property
    def about(self) -> dict[str, float]:
        """The numbers of a hypothesis beside its onset and end."""
        return {key: value for key, value in vars(self).items() if key not in ("onset", "end")}


def of(h: Hypothesis) -> Course:
    """A hypothesis' course."""
    own = {key: h.about[key] for key in ("rise", "fade", "rhythm", "period", "phase")}
    return Course(h.onset, end=h.end, **own)


def times(clip: Clip) -> np.ndarray:
    """Knots of the courses [s], (B,)."""
    return knots(clip, KNOT)


def bases(clip: Clip) -> np.ndarray:
    """What the columns of a coarse block follow in time, (B, T)."""
    return hats(times(clip), clip)


def exactly(course: Course, clip: Clip) -> np.ndarray:
    """A course over the fitted frames, (T,)."""
    return course.on(clip.time[: clip.until])


def tried(clip: Clip) -> list[Course]:
    """All that is tried at every place."""
    last = (clip.until - 1) / clip.fps
    onsets = np.arange(0.0, 0.92 * last, MOMENT)
    stays = [Course(float(o), rise) for o in onsets for rise in RISES]
    fading = [Course(float(o), fade=fade) for o in onsets for fade in FADES]
    ends = [Course(float(o), end=float(o + lasts)) for o in onsets for lasts in LASTS if o + lasts < last]
    rhythms = [
        Course(BEFORE, rhythm=1.0, period=period, phase=phase)
        for period in PERIODS
        for phase in PHASES
        if period < last
    ]
    return [Course(0.0, GROWS * last), *stays, *fading, *ends, *rhythms]


def near(course: Course, step: float) -> Iterator[Course]:
    """Beside a course; step: a share of the coarse search's spacing."""
    yield course
    if course.rhythm > 0:
        for by in (-0.5, 0.5):
            yield replace(course, period=course.period * float(np.exp(0.3 * by * step)))
            yield replace(course, phase=course.phase + by * step * np.pi / 4)
        return
    shifts = step * MOMENT * np.array([-0.5, 0.0, 0.5])
    scales = np.exp(0.7 * step * np.array([-1.0, 0.0, 1.0]))
    for shift in shifts:
        for scale in scales:
            onset = max(course.onset + float(shift), 0.0)
            yield replace(course, onset=onset, rise=max(course.rise * float(scale), 0.08))
            if course.fade < LASTING:
                yield replace(course, onset=onset, fade=course.fade * float(scale))
            if course.end is not None:
                yield replace(course, onset=onset, end=course.end + 2 * float(shift))


def free(h: Hypothesis) -> list[knobs.Knob]:
    """What a fit may turn about a hypothesis' course."""
    course = of(h)
    if course.rhythm > 0:
        return [knobs.logarithm("period", 0.15), knobs.plus("phase", 0.5)]
    fades = [knobs.logarithm("fade", 0.7)] if course.fade < LASTING else []
    return [*knobs.moment(h, "onset", "end"), knobs.logarithm("rise", 0.5), *fades]


def spread(courses: Sequence[Course], clip: Clip, parts: np.ndarray) -> Iterator[tuple[Course, np.ndarray]]:
    """Each course with its mix of a block's columns, (parts x B, amplitudes): `parts`, (C, H), at every knot."""
    at_knots = times(clip)
    for course in courses:
        shape = course.on(at_knots)
        if np.abs(shape).max() > 1e-3:
            yield course, np.kron(parts, shape[:, None])
