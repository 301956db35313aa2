"""A base, and every law beside it, fitted to all recordings of a body by runs of the engine."""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from surgisim.diagnosis.base import HIGH, LOW, TERMS, values_on
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.memo import NOTHING_KEPT, Memo
from surgisim.diagnosis.prior import SPREAD, USUAL, Prior
from surgisim.diagnosis.swinging.course import Course, seen_period, simulate, turned
from surgisim.diagnosis.swinging.law import Frame, Law
from surgisim.estimation.identify import NINETY
from surgisim.mpm.setup import Values
from surgisim.mpm.simulator import Breakdown
from surgisim.physics.catalogue import choose
from surgisim.physics.place import Misplaced, Place

MODULI = tuple(np.log(np.geomspace(2e3, 1e6, 14)))
"""log E that a fit may begin with: steps of 1.27 in pitch, a fifth of a turn in the swings of the first window."""
LOSSES = (0.02, 0.1, 0.4)
"""Loss factors of the slowest swing that a fit of viscosity may begin with [1]."""
SWINGS = 1.5
"""Swings in the first window of a base's fit; each window is twice as long as the one before, so that none is a whole
turn off."""
WIDER = np.array([math.log(3), 0.0, math.log(10)])
"""How far beyond a pulled tissue's numbers those of a base are tried: silicone is stiffer, and less viscous."""
HELPS = 0.9
"""Share of the base's squares in the second window that a law may leave to be fitted to all frames; chosen."""
EVALUATIONS, TRIES, ENOUGH, STEP, NOUGHT = 8, 4, 3e-3, 0.03, 0.1
"""Steps of a fit at most, and how often each is tried shorter; share of the squares below which a step is the last one;
of differences, over a number's size; size of what begins at zero."""
SETTLING = 1.0
"""Drag by which a body that is seen only at rest gets there, over its slowest angular frequency [1]."""
Say = Callable[[str], None]


@dataclass(frozen=True)
class Body:
    """What all runs share."""

    courses: tuple[Course, ...]
    """Of each recording that is fitted."""
    elastic: bool
    """Whether the base has no viscosity."""
    settles: bool
    """Whether only where it came to rest is seen."""
    memo: Memo = NOTHING_KEPT

    @property
    def clip(self) -> Clip:
        return self.courses[0].clip

    def base(self, x: np.ndarray, period: float) -> Values:
        """Values of a base with numbers (3,), whose slowest period is this long [s]."""
        values = values_on(self.clip, x)
        chosen = {TERMS[0]: values[TERMS[0]]} if self.elastic or self.settles else dict(values)
        return chosen | ({"drag": {"c": SETTLING * 2 * math.pi / period}} if self.settles else {})

    def moved(self, course: Course, values: Values, places: dict[str, Place]) -> np.ndarray:
        """Displacement of a course's points [m], (K, until, 3). Raises Breakdown."""
        own = {law: {k: float(v) for k, v in numbers.items()} for law, numbers in values.items()}
        return simulate(course.clip, own, places, course.until, self.memo)

    def left(self, courses: Sequence[Course], values: Values, places: dict[str, Place], weighted: bool = True):
        """Recorded less simulated of all courses [m], (M, 3). Raises Breakdown."""
        parts = []
        for course in courses:
            moved = self.moved(course, values, places)
            parts.append(course.weighted(moved) if weighted else course.left(moved))
        return np.concatenate(parts)


def rms(left: np.ndarray) -> float:
    """Distance [m]."""
    return float(np.sqrt((left**2).sum(1).mean()))


@dataclass(frozen=True)
class Tried:
    """A law, or the base alone, with numbers that were fitted."""

    law: Law | None
    x: np.ndarray
    """log E, nu, log eta / E of the base that goes with it, (3,)."""
    numbers: np.ndarray
    """The law's own."""
    values: Values
    places: dict[str, Place]
    fitted: float
    """RMS distance in what is fitted [m]."""
    other: float
    """The same in what is held out."""
    spread: np.ndarray
    """Standard deviation of log E, log eta / E and the law's own numbers, each as it is searched."""

    @property
    def called(self) -> str:
        """The law, for a reader."""
        return self.law.called(self.numbers) if self.law.called else self.law.term.replace("_", " ")


@dataclass(frozen=True)
class Numbers:
    """Of a base."""

    x: np.ndarray
    """log E, nu and log eta / E, (3,)."""
    spread: np.ndarray
    """Standard deviation, (3,); zero of what was not fitted."""


def fit_base(body: Body, period: Callable[[np.ndarray], float], given: Prior | None, say: Say) -> Numbers:
    """What suits all fitted frames, from short windows to all.

    period: slowest one of a base with these numbers; given: what another recording told, beyond which nothing goes.
    """
    middle = (USUAL if given is None else given).middle.copy()
    ends = bounds(given)
    whole = max(course.until for course in body.courses)
    if body.elastic and not body.settles:
        # What loses nothing swings like what does only for a while.
        whole = min(whole, 2 * _first_window(body, whole))
    unit = period(middle)

    def of(log_E: float, lag: float | None = None) -> np.ndarray:
        x = middle.copy()
        x[0] = log_E
        x[2] = middle[2] if lag is None else lag
        return x

    def slow(x: np.ndarray) -> float:
        # Of a body held as it is, it goes with the root of its modulus.
        return unit * math.exp(0.5 * (middle[0] - x[0]))

    def off(x: np.ndarray, until: int) -> float:
        try:
            return rms(body.left([c.first(until) for c in body.courses], body.base(x, slow(x)), {}))
        except Breakdown:
            return math.inf

    if given is None:
        first = whole if body.settles else _first_window(body, whole)
        say(f"a base, {len(MODULI)} moduli over {first} frames")
        tried = {log_E: off(of(log_E), first) for log_E in MODULI}
        best = of(min(tried, key=tried.get))
    else:
        first, best = whole, middle.copy()
    free = [0] if body.elastic or body.settles else [0, 2]
    if given is None and 2 in free:
        lags = [math.log(loss * slow(best) / (2 * math.pi)) for loss in LOSSES]
        best = min((of(best[0], lag) for lag in lags), key=lambda x: off(x, min(2 * first, whole)))
    until = first
    while True:
        say(f"base over {until} of {whole} frames: E {math.exp(best[0]):.0f} Pa")
        courses = [c.first(until) for c in body.courses]
        found = _fitted(body, courses, best, free, slow, ends)
        best = found.x
        if until >= whole:
            return found
        until = min(2 * until, whole)


def _first_window(body: Body, whole: int) -> int:
    """Frames of the first SWINGS, by how often the body's liveliest component turns round."""
    turn = turned(body.clip)
    # A first turn is half a swing from where it was let go.
    frames = whole if turn is None else round(2 * SWINGS * turn)
    return int(np.clip(frames, min(8, whole), whole))


def _fitted(
    body: Body, courses: list[Course], x: np.ndarray, free: list[int], slow, ends: tuple[np.ndarray, np.ndarray]
) -> Numbers:
    def there(y: np.ndarray) -> np.ndarray:
        moved = x.copy()
        moved[free] = y
        return moved

    def left(y: np.ndarray) -> np.ndarray:
        return body.left(courses, body.base(there(y), slow(there(y))), {})

    y, fun, jac = descend(left, x[free], np.ones(len(free)), *(end[free] for end in ends))
    spread = np.zeros(3)
    spread[free] = np.sqrt(np.diag(covariance(fun, jac, independent(courses, slow(there(y))))))
    return Numbers(there(y), spread)


def bounds(given: Prior | None) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest numbers of a base that are tried, (3,) each: inside what another recording told, as far as it
    did."""
    low, high = LOW - WIDER, HIGH + WIDER
    if given is not None:
        told = given.spread < SPREAD
        low = np.where(told, given.middle - NINETY * given.spread, low)
        high = np.where(told, given.middle + NINETY * given.spread, high)
    return low, high


def independent(courses: Sequence[Course], period: float) -> float:
    """As how many samples what is left of courses counts: two a swing, no fewer than 3; chosen."""
    return max(2 * sum(c.until / c.clip.fps for c in courses) / period, 3.0)


def covariance(fun: np.ndarray, jac: np.ndarray, count: float) -> np.ndarray:
    """Of numbers of least squares, over their size, where what is left, (M,), counts as so many samples, (N, N)."""
    normal = jac.T @ jac / len(fun) * count / max(float((fun**2).mean()), 1e-30)
    return np.linalg.inv(normal + 1e-6 * np.eye(len(normal)))


def descend(
    left: Callable[[np.ndarray], np.ndarray], start: np.ndarray, size: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Numbers of least squares (N,) near a start, what they leave [m], (M,), and its derivative by numbers over their
    size, (M, N).

    Levenberg and Marquardt's steps, those of numbers at an end that would go beyond it left out: what hangs on the very
    end of a body lies at the end of where it may be. low, high: ends; size: of a number's change that is worth as much
    as another's. Raises what `left` does at the start.
    """

    def off(y: np.ndarray) -> np.ndarray | None:
        try:
            return left(y).ravel()
        except (Breakdown, Misplaced):
            return None

    y, damping = np.clip(start, low, high), 1e-2
    now = left(y).ravel()
    jac = np.zeros((len(now), len(y)))
    for _ in range(EVALUATIONS):
        for k, way in enumerate(np.diag(size)):
            for step in (STEP, -STEP) if y[k] + STEP * size[k] <= high[k] else (-STEP, STEP):
                moved = off(y + step * way)
                if moved is not None:
                    jac[:, k] = (moved - now) / step
                    break
        pull = -jac.T @ now
        free = ~(((y <= low) & (pull < 0)) | ((y >= high) & (pull > 0)))
        before = float(now @ now)
        for _ in range(TRIES):
            normal = jac[:, free].T @ jac[:, free]
            by = np.zeros(len(y))
            by[free] = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-30), pull[free])
            there = np.clip(y + by * size, low, high)
            tried = off(there)
            if tried is not None and tried @ tried < before:
                y, now, damping = there, tried, max(damping / 8, 1e-4)
                break
            damping *= 8
        if before - float(now @ now) < ENOUGH * before:
            break
    return y, now, jac


def try_base(body: Body, x: np.ndarray, other: Course | None, period: float) -> Tried:
    """The base alone."""
    values = body.base(x, period)
    fitted = rms(body.left(body.courses, values, {}, weighted=False))
    apart = math.nan if other is None else other.rms(body.moved(other, values, {}))
    return Tried(None, x, np.zeros(0), values, {}, fitted, apart, np.zeros(0))


def try_law(law: Law, body: Body, base: np.ndarray, given: Prior | None, other: Course, frame: Frame) -> Tried | None:
    """Scan, fit together with the base's modulus, foretell what is held out; None where every run breaks down.

    base: the base's own numbers, (3,); given: what another recording told of them.
    """
    whole = max(course.until for course in body.courses)
    # A law that changes the pitch is whole turns off in a long window: the first one is short, as a base's.
    first = whole if body.settles else _first_window(body, whole)
    scanned, some = ([c.first(n) for c in body.courses] for n in (first, min(2 * first, whole)))
    nearest = 0 if body.elastic or body.settles else 1

    def made(y: np.ndarray) -> tuple[Values, dict[str, Place]]:
        own, places = law.make(y[1 + nearest :])
        x = base.copy()
        x[0] += y[0] - (0.0 if law.divides is None else math.log(y[1 + nearest + law.divides]))
        if nearest:
            x[2] += y[1]
        values = body.base(x, frame.period * math.exp(0.5 * (base[0] - x[0])))
        return values | own, places

    def left(y: np.ndarray, courses: Sequence[Course], weighted: bool = True) -> np.ndarray:
        return body.left(courses, *made(y), weighted)

    own = np.zeros(1 + nearest)
    starts = [np.concatenate([own, numbers]) for numbers in itertools.product(*law.scan)]
    costs = []
    for y in starts:
        try:
            costs.append(rms(left(y, scanned)))
        except (Breakdown, Misplaced):
            costs.append(math.inf)
    if not np.isfinite(costs).any():
        return None
    y = starts[int(np.argmin(costs))]
    if given is not None and nearest:
        # Viscosity was told at the other recording's pitch; what loses as much in every swing has more at a slower one.
        apart = abs(math.log(seen_period(body.clip) / frame.period))
        given = replace(given, spread=np.hypot(given.spread, [0.0, 0.0, apart]))
    least, most = (end[[0, 2]][: 1 + nearest] - base[[0, 2]][: 1 + nearest] for end in bounds(given))
    low, high = np.concatenate([least, law.low]), np.concatenate([most, law.high])
    numbers = np.abs(y[1 + nearest :])
    size = np.concatenate([np.ones(1 + nearest), np.where(numbers > 0, numbers, NOUGHT)])

    def beside(courses: Sequence[Course], begin: np.ndarray):
        """What is left of courses beside how far the base is from what was told of it."""
        count = independent(courses, frame.period)
        unsure = np.full(1 + nearest, np.inf) if given is None else given.spread[[0, 2]][: 1 + nearest]
        one = math.sqrt(float((left(begin, courses) ** 2).sum()) / count)
        return lambda y: np.concatenate([left(y, courses).ravel(), one * y[: 1 + nearest] / unsure])

    try:
        alone = float((body.left(some, body.base(base, frame.period), {}) ** 2).sum())
        y, fun, jac = descend(beside(some, y), y, size, low, high)
        if not body.settles and float(fun @ fun) < HELPS * alone:
            y, fun, jac = descend(beside(body.courses, y), y, size, low, high)
    except (Breakdown, Misplaced):
        return None
    spread_of = size * np.sqrt(np.diag(covariance(fun, jac, independent(body.courses, frame.period))))
    values, places = made(y)
    x = base.copy()
    x[0] += y[0]
    if nearest:
        x[2] += y[1]
    apart = rms(left(y, body.courses, weighted=False))
    moved = body.moved(other, values, places)
    return Tried(law, x, y[1 + nearest :], values, places, apart, other.rms(moved), spread_of)


def units(tried: Tried) -> dict[str, dict]:
    """A law's numbers with 90 % intervals and units, as diagnosis.json has them."""
    terms = choose([tried.law.term])[tried.law.term].params
    found = {k: {"value": float(v), "unit": terms[k].unit} for k, v in tried.values[tried.law.term].items()}
    own = tried.spread[-len(tried.numbers) :]
    for number, sd in zip(tried.numbers, own, strict=True):
        for entry in found.values():
            if abs(entry["value"] - abs(number)) <= 1e-9 * max(abs(number), 1e-9) and "low" not in entry:
                entry |= {"low": float(abs(number) - 1.645 * sd), "high": float(abs(number) + 1.645 * sd)}
                break
    return found
