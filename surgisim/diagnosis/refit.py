"""Laws as the engine runs them: their strength alone, or with everything about them and the base free."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from surgisim.diagnosis import candidates
from surgisim.diagnosis.base import BOLD, bounded
from surgisim.diagnosis.base_fit import without
from surgisim.diagnosis.evidence import Finding
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.laws import IMPOSSIBLE, Law, beside, law_of, respond
from surgisim.diagnosis.refine import refined

SOFTER = (0.3, 0.1)
"""Shares of the base's stiffness with which a law that tears it is tried."""
NOTHING = Law({}, {}, None)
RUNS = 35
"""That fitting a law with everything about it free takes, roughly."""


@dataclass(frozen=True)
class Refit:
    """A law as the engine runs it, fitted."""

    finding: Finding
    amplitude: np.ndarray
    response: np.ndarray
    """What it adds to the base at this amplitude over the whole clip [m], (K, T, 3)."""
    gain: float
    log_evidence: float
    x: np.ndarray | None = None
    """The base that was fitted with it, and its moments of release, (3 + R,); None where the base stayed."""
    spread: np.ndarray | None = None
    """Posterior standard deviation of that base's numbers, (3,)."""
    draws: tuple[tuple[Hypothesis, np.ndarray], ...] = ()
    """The law with other numbers that would do, drawn from its posterior; none where it was not fitted freely."""

    @property
    def term(self) -> str:
        return self.finding.hypothesis.term

    @property
    def searched(self) -> float:
        """log evidence before the engine ran."""
        return self.log_evidence - 0.5 * (self.gain - self.finding.gain)


def refit(case, finding: Finding, evidence: float, z: np.ndarray, rounds: int = 3) -> Refit:
    """The law in the engine, its strength by secants of its response; what the tangent left out is put back.

    Where the engine breaks down even in softer tissue, a weaker law is tried, then the tangent's word is taken.
    """
    base, until = case.base, case.clip.until
    amplitude, gain, response = finding.amplitude.copy(), -np.inf, None
    for _ in range(rounds):
        change = added(case, finding.hypothesis, amplitude)
        if change is None:
            amplitude = 0.5 * amplitude
            continue
        white = case.whiten(change[:, :until])[:, None]
        G, b = float(case.space.gram(white, white)[0, 0]), float(case.space.gram(white, z[:, None])[0, 0])
        best = b / max(G, 1e-12)
        # Near its best strength a response may be scaled; far from it, only another run tells.
        scale = float(np.clip(best, 0.3, 1.4))
        mine = 2 * scale * b - scale**2 * G
        if mine > gain:
            gain, response, kept = mine, scale * change, scale * amplitude
        if abs(best - 1) < 0.1 or best <= 0:
            break
        amplitude = amplitude * float(np.clip(best, 0.4, 2.5))
    if response is None:
        return Refit(finding, finding.amplitude, np.zeros_like(base.simulated), 0.0, -np.inf)
    return Refit(finding, kept, response, gain, evidence + 0.5 * (gain - finding.gain))


def added(case, h: Hypothesis, amplitude: np.ndarray) -> np.ndarray | None:
    """What a law adds to the base over the whole clip [m], (K, T, 3); None where the engine breaks down.

    A base that was fitted without a law may be many times too stiff. A weight that pulls as far in tissue like that is
    so heavy that its inertia tears it: there it is tried in softer tissue, as much lighter.
    """
    clip, base, memo = case.clip, case.base, case.memo
    try:
        return respond(clip, base, law_of(h, amplitude, clip), memo) - base.simulated
    except IMPOSSIBLE:
        if candidates.of(h).beside is None:
            return None
    for share in SOFTER:
        x = bounded(base.x[:3] + np.array([np.log(share), 0.0, 0.0]), clip)
        softer = replace(base, x=np.concatenate([x, base.x[3:]]))
        try:
            law = law_of(*beside(h, amplitude, float(np.exp(x[0] - base.x[0]))), clip)
            return respond(clip, softer, law, memo) - respond(clip, softer, NOTHING, memo)
        except IMPOSSIBLE:
            continue
    return None


def freed(case, one: Refit, z: np.ndarray, say: Callable[[str], None]) -> Refit:
    """The same law with everything about it free; as it was where the engine breaks down.

    Its gain is never less than before: there the base moved along its tangent, which takes more than tissue gives.
    """
    say(f"the base beside {one.term}")
    base_at, aside = without(case, one.response, say)
    found = refined(case, z, [(one.finding.hypothesis, one.amplitude)], one.response, say, base_at)
    if found is None:
        return one
    (hypothesis, amplitude), gain = found.laws[0], max(found.gain, one.gain)
    evidence = one.log_evidence + 0.5 * (gain - one.gain)
    finding = replace(one.finding, hypothesis=hypothesis)
    spread = np.hypot(found.spread, aside)
    return Refit(finding, amplitude, found.response, gain, evidence, found.x, spread, tuple(found.draws[0]))


def fit_of_a_law(case) -> float:
    """Particles times steps that a law with everything about it free takes, roughly."""
    base = case.base
    steps = base.prepared.per_frame(base.values, case.clip.fps, BOLD) * case.clip.until
    return RUNS * len(base.prepared.simulator.rest) * steps
