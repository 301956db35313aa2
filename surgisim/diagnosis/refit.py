"""Laws as the engine runs them: their strength alone, or with everything about them and the base free."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from surgisim.diagnosis import candidates
from surgisim.diagnosis.base import BOLD, Known, values_on
from surgisim.diagnosis.base_fit import without
from surgisim.diagnosis.evidence import Finding
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.laws import IMPOSSIBLE, beside, respond
from surgisim.diagnosis.refine import refined
from surgisim.diagnosis.ring_down import Descent

BASES = 2
"""Of those that fit beside a law's response, how many its fit begins with; with a heavy law all."""
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
    known: Known | None = None
    """How surely."""
    draws: tuple[tuple[Hypothesis, np.ndarray], ...] = ()
    """The law with other numbers that would do, drawn from its posterior; none where it was not fitted freely."""
    begun: tuple[Descent, ...] = ()
    """Where bases got to beside it."""

    @property
    def term(self) -> str:
        return self.finding.hypothesis.term

    @property
    def searched(self) -> float:
        """log evidence before the engine ran."""
        return self.log_evidence - 0.5 * (self.gain - self.finding.gain)


def refit(case, finding: Finding, evidence: float, z: np.ndarray, rounds: int = 3) -> Refit:
    """The law in the engine, its strength by secants of its response; what the tangent left out is put back.

    Where the engine breaks down, a weaker law is tried, then the tangent's word is taken. A heavy law is tried without
    its inertia too: it slows tissue, and a base that was fitted without it is not the one that it slows.
    """
    candidate, found = candidates.of(finding.hypothesis), []
    for law in (candidate.law, candidate.light):
        if law is not None:
            found += _by_secants(case, finding, z, law, rounds)
    if not found:
        return Refit(finding, finding.amplitude, np.zeros_like(case.base.simulated), 0.0, -np.inf)
    gain, amplitude, response = max(found, key=lambda f: f[0])
    return Refit(finding, amplitude, response, gain, evidence + 0.5 * (gain - finding.gain))


def _by_secants(case, finding: Finding, z: np.ndarray, law_of, rounds: int) -> list[tuple]:
    """Gain, amplitude and response of the best strength; none where the engine breaks down."""
    clip, base, until = case.clip, case.base, case.clip.until
    amplitude, best = finding.amplitude.copy(), []
    for _ in range(rounds):
        try:
            moved = respond(clip, base, law_of(finding.hypothesis, amplitude, clip), case.memo)
        except IMPOSSIBLE:
            amplitude = 0.5 * amplitude
            continue
        change = moved - base.simulated
        white = case.whiten(change[:, :until])[:, None]
        G, b = float(case.space.gram(white, white)[0, 0]), float(case.space.gram(white, z[:, None])[0, 0])
        times = b / max(G, 1e-12)
        # Near its best strength a response may be scaled; far from it, only another run tells.
        scale = float(np.clip(times, 0.3, 1.4))
        gain = 2 * scale * b - scale**2 * G
        if not best or gain > best[0][0]:
            best = [(gain, scale * amplitude, scale * change)]
        if abs(times - 1) < 0.1 or times <= 0:
            break
        amplitude = amplitude * float(np.clip(times, 0.4, 2.5))
    return best


def freed(case, one: Refit, z: np.ndarray, say: Callable[[str], None]) -> Refit:
    """The same law with everything about it free; as it was where the engine breaks down.

    Its gain is never less than before: there the base moved along its tangent, which takes more than tissue gives.
    """
    say(f"the base beside {one.term}")
    start, heavy = (one.finding.hypothesis, one.amplitude), candidates.of(one.finding.hypothesis).light is not None
    begun = without(case, one.response, say)
    bases = [d.y for d in begun[: None if heavy else BASES]]
    found = refined(case, z, [start], one.response, say, bases, begun)
    if found is None:
        return one
    (hypothesis, amplitude), gain = found.laws[0], max(found.gain, one.gain)
    evidence = one.log_evidence + 0.5 * (gain - one.gain)
    finding = replace(one.finding, hypothesis=hypothesis)
    return Refit(
        finding, amplitude, found.response, gain, evidence, found.x, found.known, tuple(found.draws[0]), tuple(begun)
    )


def kept(case, one: Refit) -> Refit:
    """A law with the numbers that were fitted with it, in the base that was fitted without it."""
    h, amplitude = beside(one.finding.hypothesis, one.amplitude, float(np.exp(case.base.x[0] - one.x[0])))
    finding = replace(one.finding, hypothesis=h, amplitude=amplitude, gain=one.gain)
    return refit(case, finding, one.log_evidence, case.z)


def fit_of_a_law(case) -> float:
    """Particles times steps that a law with everything about it free takes, roughly."""
    base = case.base
    steps = base.prepared.per_frame(values_on(case.clip, base.x), case.clip.fps, BOLD) * case.clip.until
    return RUNS * len(base.prepared.simulator.rest) * steps
