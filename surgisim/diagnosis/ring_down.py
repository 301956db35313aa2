"""E, viscosity and moments of release, by what a release looks like: short runs that begin just before it.

Chi square has many valleys: a ring-down misfits by whole periods, one that is faster than the frames looks like a
slower one, and a soft body let go early looks like a stiff one let go late. So the search begins with stiffnesses all
over the range and gives up the worst, a few steps at a time. Where each of them ended is kept: bodies that fit about as
well are part of how surely a base is known.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from surgisim.diagnosis import calibration
from surgisim.diagnosis.base import bounded, carried, run_base, values_on
from surgisim.diagnosis.clip import OPENS, Clip
from surgisim.diagnosis.memo import Memo
from surgisim.diagnosis.metric import Metric
from surgisim.diagnosis.noise import Whitener
from surgisim.diagnosis.prior import USUAL
from surgisim.diagnosis.pulls import Pulls
from surgisim.estimation.trial import at_once
from surgisim.mpm.setup import Prepared
from surgisim.mpm.simulator import Breakdown, Run

STEP = np.array([0.2, 0.01, 0.3])
LATE = 0.5
"""Standard deviation of the moment of a release about the middle of the interval in which it falls [frames]; one that
is the same everywhere in it has .29, and whoever marks frames may be a frame off."""
EARLIEST, LATEST = -1.4, 2.4
"""Of a release after a grip's last active frame that is tried [frames]."""
STIFFNESSES = tuple(np.log(np.geomspace(6e2, 3.6e4, 8)))
LAGS = tuple(np.log(np.array([2e-4, 2e-3, 1.2e-2])))
MOMENTS = (0.0, 0.5, 1.0)
"""Where a descent may start, logarithms of E and of eta / E, and moments of release [frames]. A step
of 1.8 in E is one of a third in pitch: within half a period of the next one while a ring-down lasts two."""
KEPT = ((1, 5), (2, 3))
"""Steps that every descent still tried goes, and how many go on then."""
DESCENTS = 8
"""Steps at most of those that are left."""
HOPELESS = 4.0
"""Times the best stiffness' cost at a middling viscosity beyond which another one is not tried with other viscosities
and moments of release; chosen. Stiff bodies of high viscosity take the shortest steps by far."""
HOPED = 3.0
"""Times what the parabola under a descent promises that its next steps may take off; chosen. One that would then still
be no body that is drawn once (DRAWS, calibration.ALIKE_ERRORS) goes no further."""
SAME = 0.1
"""Prior standard deviations within which two descents are one."""
ALIKE = 2.0
"""What chi square a softer body may cost more. Tissue that creeps back tells eta / E alone: of bodies that look alike
the softest takes the longest steps."""
DRAWS = 400
"""Of bodies that would do."""
ASIDE = 0.05
"""Share of what a base leaves unexplained, noise aside, below which nothing about it is worth another step: where
something is hidden no base fits, and its numbers are fitted again with every law."""
AFTER = 0.5
"""How long a short run goes on after the release [s]."""


@dataclass
class Descent:
    """One way down."""

    y: np.ndarray
    """(3 + R,)"""
    left: np.ndarray | None
    """Whitened residual, (N,); None where tissue like that is torn apart."""
    cost: float
    owed: float = 0.0
    """Of the cost, what its numbers owe to what is known of this body beforehand, beyond any tissue's."""
    damping: float = 1e-2
    done: bool = False


@dataclass(frozen=True)
class RingDown:
    """Tracks near a run at `x`: nu moves them along its slope; E, eta and moments of release by short runs from the
    run's own states."""

    clip: Clip
    whiten: Whitener
    space: Metric
    memo: Memo
    bodies: list[Prepared]
    """One for each short run at a time."""
    carry: object
    x: np.ndarray
    """(3 + R,), R the releases whose moments are free."""
    run: Run
    simulated: np.ndarray
    """Of the run [m], (K, T_fit, 3)."""
    by_poisson: np.ndarray
    pulls: Pulls | None = None
    """Forces near that run, where any were measured."""

    @property
    def middle(self) -> np.ndarray:
        """Of the prior, (3 + R,)."""
        return np.concatenate([self.clip.prior.middle, np.full(len(self.x) - 3, OPENS)])

    @property
    def reach(self) -> np.ndarray:
        """Its standard deviation, (3 + R,)."""
        return np.concatenate([self.clip.prior.spread, np.full(len(self.x) - 3, LATE)])

    def bounded(self, y: np.ndarray) -> np.ndarray:
        return np.concatenate([bounded(y[:3], self.clip), np.clip(y[3:], EARLIEST, LATEST)])

    def tracks(self, y: np.ndarray, body: int = 0) -> np.ndarray:
        """Displacement of the points [m], (K, T_fit, 3)."""
        rates = np.array([y[0], self.x[1], y[2]])
        clip = self.clip.opens(y[3:])
        result = self.simulated.copy()
        for first, last in windows(self.clip):
            what = ["short", clip.on_grid(self.x).tolist(), clip.on_grid(rates).tolist(), first, last, *clip.kind]
            seen = self.memo(what, lambda f=first, t=last: {"seen": self._short(clip, self.bodies[body], rates, f, t)})[
                "seen"
            ]
            result[:, first + 1 : last + 1] = seen
        return result + (y[1] - self.x[1]) * self.by_poisson

    def _short(self, clip: Clip, body: Prepared, rates: np.ndarray, first: int, last: int) -> np.ndarray:
        before = self.run if first else None
        run = run_base(body, clip, values_on(clip, rates), before=before, first=first, last=last)
        return carried(self.carry, run)[:, 1:]

    def left(self, y: np.ndarray, body: int = 0) -> np.ndarray | None:
        """Whitened residual, (N,); None where tissue like that is torn apart."""
        try:
            return self.whiten(self.clip.moved[:, : self.clip.until] - self.tracks(y, body))
        except Breakdown:
            return None

    def cost(self, y: np.ndarray, left: np.ndarray | None) -> float:
        if left is None:
            return np.inf
        prior = (((y - self.middle) / self.reach) ** 2).sum()
        forces = 0.0 if self.pulls is None else self.pulls.cost(y)
        return float(self.space.gram(left[:, None], left[:, None])[0, 0] + prior + forces)

    def slopes(self, y: np.ndarray) -> np.ndarray:
        """Derivative of the points' displacement by y [m], (3 + R, K, T_fit, 3)."""
        late = np.where(y[3:] > LATEST - 0.3, -0.2, 0.2)
        aside = np.concatenate([[STEP[0]], [STEP[2]], late])
        ways = np.eye(len(y))[[0, 2, *range(3, len(y))]]
        middle, *moved = at_once(
            self.tracks, [y, *(y + a * e for a, e in zip(aside, ways, strict=True))], len(self.bodies)
        )
        stiffer, slower, *later = ((m - middle) / a for m, a in zip(moved, aside, strict=True))
        return np.stack([stiffer, self.by_poisson, slower, *later])

    def normal(self, slopes: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Second derivative of half the cost at y by y, (3 + R, 3 + R)."""
        J = self.whiten(slopes).T
        normal = self.space.gram(J, J) + np.diag(1 / self.reach**2)
        if self.pulls is not None:
            normal[:3, :3] += self.pulls.slopes(y).T @ self.pulls.slopes(y)
        return normal

    def pull(self, slopes: np.ndarray, at: "Descent") -> np.ndarray:
        """Less the first derivative of half the cost where a descent is, (3 + R,)."""
        pull = self.space.gram(self.whiten(slopes).T, at.left[:, None])[:, 0] - (at.y - self.middle) / self.reach**2
        if self.pulls is not None:
            pull[:3] += self.pulls.slopes(at.y).T @ self.pulls.left(at.y)
        return pull

    def steady(self) -> np.ndarray:
        """Where the run began, with the nu that pull and hold ask for, which hardly depends on the other numbers."""
        y, left = self.x.copy(), self.left(self.x)
        if left is None:
            return y
        J = self.whiten(self.by_poisson)[:, None]
        middle, sure = self.clip.prior.middle[1], self.clip.prior.spread[1] ** -2
        normal = float(self.space.gram(J, J)[0, 0]) + sure
        y[1] += (float(self.space.gram(J, left[:, None])[0, 0]) - (y[1] - middle) * sure) / normal
        return self.bounded(y)

    def owed(self, y: np.ndarray) -> float:
        """Cost of numbers, (3 + R,), by the clip's own prior beyond that by any tissue's."""
        mine, usual = (float((((y[:3] - p.middle) / p.spread) ** 2).sum()) for p in (self.clip.prior, USUAL))
        return mine - usual

    def begun(self, y: np.ndarray, body: int = 0) -> Descent:
        left = self.left(y, body)
        return Descent(y, left, self.cost(y, left), self.owed(y))

    def starts(self) -> list[Descent]:
        """Where the run began, and the best viscosity and moment of release for each stiffness that is not hopeless."""
        steady = self.steady()
        late = (0.0,) if len(steady) == 3 else MOMENTS
        middle, others = (LAGS[1], late[len(late) // 2]), [(lag, late[len(late) // 2]) for lag in LAGS[::2]]
        others += [(LAGS[1], t) for t in (late[0], late[-1]) if late[1:]]

        def tried(ways: list[tuple[float, tuple[float, float]]]) -> list[Descent]:
            tries = []
            for e, (lag, opens) in ways:
                y = steady.copy()
                y[[0, 2]], y[3:] = (e, lag), opens
                # What may not be tried as it is is no start of its own.
                tries += [y] if np.allclose(self.bounded(y), y) else []
            return at_once(self.begun, tries, len(self.bodies))

        begun = self.begun(steady)
        plain = tried([(e, middle) for e in STIFFNESSES])
        far = HOPELESS * max(self.whiten.free, min(d.cost for d in (begun, *plain)))
        worth = [d for d in plain if d.cost < far]
        best = {d.y[0]: d for d in worth}
        for each in tried([(e, way) for e in best for way in others]):
            best[each.y[0]] = min(best[each.y[0]], each, key=lambda d: d.cost)
        return [d for d in (begun, *best.values()) if np.isfinite(d.cost)]

    def descents(self, say: Callable[[str], None], tries: list[Descent] | None = None) -> list[Descent]:
        """Where descents from all over the range got to, best first; those given up early are among them."""
        going, ended = self.starts() if tries is None else tries, []
        for steps, keep in (*KEPT, (DESCENTS, 0)):
            for each in sorted(going, key=lambda d: d.cost):
                self.descend(each, say, steps, min(d.cost for d in (*going, *ended)))
            single = self.distinct(going, SAME)
            ended += single[keep:]
            going = single[:keep]
        return sorted(ended, key=lambda d: d.cost)

    def distinct(self, ends: list[Descent], apart: float) -> list[Descent]:
        """The best of those that lie within so many prior standard deviations of one another, best first."""
        single: list[Descent] = []
        for each in sorted(ends, key=lambda d: d.cost):
            away = [np.abs((each.y - other.y) / self.reach).max() for other in single]
            if min(away, default=np.inf) > apart:
                single.append(each)
        return single

    def descend(self, at: Descent, say: Callable[[str], None], steps: int = DESCENTS, best: float = np.inf) -> None:
        """Levenberg-Marquardt, some steps on; best: cost of the best descent so far, which leaves no hope to some."""
        far = best + 2 * calibration.ALIKE_ERRORS * math.log(DRAWS)
        for _ in range(steps):
            if at.done or at.left is None:
                return
            say(f"base: {told(at.y)}")
            slopes = self.slopes(at.y)
            normal, pull = self.normal(slopes, at.y), self.pull(slopes, at)
            before = at.cost
            if before - HOPED * float(pull @ np.linalg.solve(normal, pull)) > far:
                at.done = True
                return
            if not self._downhill(at, normal, pull):
                at.done = True
                return
            at.done = before - at.cost < max(1.0, 0.02 * ASIDE * (at.cost - self.whiten.free))

    def _downhill(self, at: Descent, normal: np.ndarray, pull: np.ndarray) -> bool:
        """Take the first damped step that costs less; whether there is one.

        A grip that opens before a frame instead of in it shows there at once, which no slope foretells: where a step
        runs into that, moments of release stay and the body alone moves.
        """
        for free in sorted({len(at.y), 3}, reverse=True):
            inner, more = normal[:free, :free], at.damping
            for _ in range(4):
                step = np.zeros(len(at.y))
                step[:free] = np.linalg.solve(inner + more * np.diag(np.diag(inner)), pull[:free])
                there = self.begun(self.bounded(at.y + np.clip(step, -1.2 * self.reach, 1.2 * self.reach)))
                if there.cost < at.cost:
                    at.y, at.left, at.cost, at.owed = there.y, there.left, there.cost, there.owed
                    at.damping = max(more / 4, 1e-4)
                    return True
                more *= 8
        return False


def softest(ends: list[Descent]) -> Descent:
    """The best of descents, or a softer one that fits as well."""
    return min((d for d in ends if d.cost < ends[0].cost + ALIKE), key=lambda d: d.y[0])


def aside(ends: list[Descent], heat: float = calibration.ALIKE_ERRORS) -> np.ndarray:
    """How far x is from the chosen body where descents ended, each drawn as often as its chi square, divided by
    `heat`, and what is known of this body beforehand say, (DRAWS, 3)."""
    chosen = softest(ends)
    seen = np.array([d.cost - d.owed - (chosen.cost - chosen.owed) for d in ends])
    known = np.array([d.owed - chosen.owed for d in ends])
    weight = np.exp(-0.5 * np.maximum(seen / heat + known, 0))
    drawn = np.random.default_rng(0).choice(len(ends), DRAWS, p=weight / weight.sum())
    return np.stack([d.y[:3] - chosen.y[:3] for d in ends])[drawn]


def told(y: np.ndarray) -> str:
    """Of numbers (3 + R,), for a reader."""
    opens = f", opens {' and '.join(f'{late:.2f}' for late in y[3:])} frames late" if len(y) > 3 else ""
    return f"E {np.exp(y[0]):.0f} Pa, nu {y[1]:.3f}, eta {np.exp(y[0] + y[2]):.2f} Pa s{opens}"


def windows(clip: Clip) -> list[tuple[int, int]]:
    """From just before each release for a while, none overlapping; everything where nothing is released."""
    found: list[tuple[int, int]] = []
    for _, end in sorted(clip.releases(), key=lambda r: r[1]):
        first, last = max(end - 2, 0), min(clip.until - 1, end + math.ceil(AFTER * clip.fps))
        if found and first <= found[-1][1]:
            found[-1] = found[-1][0], max(last, found[-1][1])
        else:
            found.append((first, last))
    return found or [(0, clip.until - 1)]
