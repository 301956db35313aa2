"""What is said of a recording: which explanation stands, how probable it is, and why it is or is not named.

Every explanation (a law, or two fitted together) has the evidence of the frames that were fitted and, where frames were
held out, what it gains there over the base (prospect.py). Their sum orders them. What the frames held out refute gives
way to the next, which they must confirm. What they cannot show, because the effect does nothing there, is named only
where the fitted frames leave no doubt.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit

from surgisim.diagnosis import calibration, candidates
from surgisim.diagnosis.contact import outward
from surgisim.diagnosis.context import Case
from surgisim.diagnosis.errors import as_filmed, beside_nuisances, bootstrap, noise_floor, residual, rms, taken_off
from surgisim.diagnosis.evidence import Scores, best
from surgisim.diagnosis.foretold import of_base, of_laws
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.joint import Joint, least, prediction
from surgisim.diagnosis.noise import Noise
from surgisim.diagnosis.noise_fit import estimate
from surgisim.diagnosis.prospect import Gain
from surgisim.diagnosis.refit import Refit, kept
from surgisim.diagnosis.saturated import SmoothFit

REASONS = (
    "named", "faint", "ungrasped", "loose", "drawn", "little", "unbacked", "unfit", "unconfirmed", "refuted", "beaten",
)  # fmt: skip


@dataclass(frozen=True)
class Explanation:
    """Laws that may be named."""

    fitted: Joint
    log_evidence: float
    """Of the frames that were fitted."""
    ahead: Gain | None
    """What it gains over the base in the frames held out; None where there are none."""
    left: float
    """Share of what a smooth field could explain that is left beside it."""
    outward: float | None
    """How far a push among its laws points out of the tissue (contact.py); None without one."""
    falls: bool = False
    """Whether the plain error of the frames held out, nuisances aside, falls with it by more than its interval."""
    rises: bool = False
    """Whether it rises by more than that."""
    may_leave: float = calibration.PUSH_LEAVES
    """Share of what a smooth field could explain that a push may leave."""
    smooth: float = 1.0
    """What a smooth field could explain, over what its laws do."""

    @property
    def first(self) -> Refit:
        return self.fitted.refits[0]

    @property
    def support(self) -> float:
        """log evidence of all frames: those held out count as a prediction of numbers that were fitted elsewhere."""
        return self.log_evidence + (0.0 if self.ahead is None else 0.5 * self.ahead.value)

    @property
    def enough(self) -> bool:
        """Whether its evidence suffices to name it: that of the fitted frames, to which those held out add."""
        return self.log_evidence >= calibration.TRIED and self.support >= calibration.THRESHOLD

    @property
    def loose(self) -> bool:
        """Whether a push, which follows whatever comes and goes, leaves more than one that is there would."""
        law = candidates.of(self.first.finding.hypothesis)
        return law.free_course and self.left > self.may_leave

    @property
    def drawn(self) -> bool:
        """Whether a push draws tissue out of its surface, as no contact can."""
        return self.outward is not None and self.outward > calibration.PULLS

    @property
    def sound(self) -> bool:
        """Whether nothing speaks against it but what has not been seen."""
        return self.enough and not (self.refuted or self.loose or self.drawn)

    @property
    def refuted(self) -> bool:
        """By their likelihood, or by their plain error."""
        return self.rises or (self.ahead is not None and self.ahead.refuted)

    @property
    def confirmed(self) -> bool:
        """By their likelihood; or by their plain error where the likelihood, which allows for a camera, agrees."""
        return self.ahead is not None and (
            self.ahead.confirmed or (self.visible and self.falls and self.ahead.value > 0)
        )

    @property
    def as_promised(self) -> bool:
        """Whether fitted frames leave no doubt and those held out gain about what it promises: where that is little
        more than noise makes, no interval of it can be expected to lie above nothing."""
        sure = self.log_evidence >= calibration.CERTAIN and self.ahead is not None
        return sure and self.ahead.value >= calibration.HALF * self.ahead.expected

    @property
    def foretold(self) -> bool:
        """Whether fitted frames leave no doubt and those held out gain by it about what it promises: then a plain
        error, of which a camera that walks is most, need not fall as far."""
        return self.as_promised and self.ahead.confirmed

    @property
    def visible(self) -> bool:
        return self.ahead is not None and self.ahead.visible


@dataclass(frozen=True)
class Judgement:
    """What is said of a recording, before it is written down."""

    verdict: str
    reason: str
    """One of REASONS."""
    chosen: Explanation | None
    chances: dict[str, float]
    """Law -> probability."""
    explained: float
    """Share of the misfit that can be told from noise, which what is named, or comes nearest, takes away."""
    after: np.ndarray
    """Displacement of the points with what is named [m], (K, T, 3)."""
    noise: Noise
    borne: float | None = None
    """What `borne_out` says of it."""
    over_placebo: Gain | None = None
    others: tuple[Refit, ...] = ()
    """Of an equivalence class, the laws that it may be instead, most probable first."""

    @property
    def named(self) -> bool:
        return self.verdict in ("named", "equivalence class")

    @property
    def accepted(self) -> list[Refit]:
        """Laws that say something, best first."""
        return [] if self.chosen is None else self.chosen.fitted.refits


def explanations(case: Case, refits: list[Refit], fitted: Joint) -> list[Explanation]:
    """What may be named, most supported first. fitted: the best law, or two that pay together; refits: all."""
    singles = [r for r in refits if r.response.any() and r is not fitted.refits[0]]
    tried = [fitted, *(prediction(case, [r], case.base.simulated + r.response, r.x) for r in singles)]
    if len(fitted.refits) == 1:
        tried = [t for t in tried if t is fitted or t.refits[0].term != fitted.refits[0].term]
    return sorted((_explanation(case, t) for t in tried), key=lambda e: -e.support)


def _explanation(case: Case, fitted: Joint) -> Explanation:
    """A law that frames held out speak against in its own base may stand in the one that was fitted without it.

    A law that does nothing there is then refuted by its base alone, which bore with what the law's form has wrong.
    """
    found, first = _judged_ahead(case, fitted), fitted.refits[0]
    if not found.refuted or len(fitted.refits) > 1 or first.x is None:
        return found
    law = kept(case, first)
    other = _judged_ahead(case, prediction(case, [law], case.base.simulated + law.response, None))
    return found if other.refuted else other


def _judged_ahead(case: Case, fitted: Joint) -> Explanation:
    ahead = None
    if case.prospect is not None:
        ahead = case.prospect.gain(of_base(case), of_laws(case, fitted.refits, fitted.moved))
    out = max((out for out, _ in pushes(case.clip.recording, fitted.refits)), default=None)
    both = (beside_nuisances(case, s, whole=True) for s in (case.base.simulated, fitted.moved))
    low, high = bootstrap(case, *both)
    falls, rises = low is not None and low > 0, high is not None and high < 0
    if guessed(case):
        # A guessed body is off by as much as noise everywhere: only beyond that a rise says something.
        rises = rises and rms(case, fitted.moved)[1] > noise_floor(case.noise)
    may_leave = 1 - calibration.HALF if guessed(case) else calibration.PUSH_LEAVES
    left, smooth = still(case, fitted.moved), explainable(case.smooth) / max(fitted.gain, 1e-9)
    return Explanation(fitted, fitted.refits[0].log_evidence, ahead, left, out, falls, rises, may_leave, smooth)


def judged(
    case: Case, laws: Scores, tried: list[Explanation], over: Gain | None = None, worse: bool = False
) -> Judgement:
    """Where something is detected.

    over: what is named gains over a placebo in the frames held out; worse: whether the error there rises with it.
    """
    chances = probabilities(laws, tried, calibration.GUESSED if guessed(case) else calibration.MISFIT)
    chosen = simplest(case, stands(tried), tried, chances)
    fitted, term = chosen.fitted, chosen.first.term
    total = max(explainable(case.smooth), fitted.gain, 1e-9)
    explained = float(np.clip(fitted.gain / total, 0, 1))
    noise = noise_beside(case, fitted.moved)
    borne = borne_out(case, fitted.moved)
    others = alike(case, chosen, tried, chances) if guessed(case) else instead(chosen, tried, chances)
    held = chances[term] + sum(chances[r.term] for r in others)
    if guessed(case):
        rivals = (c for t, c in chances.items() if t != term and t not in {r.term for r in others})
        ahead = held > calibration.TWICE * max(rivals, default=0.0)
        reason = _reason_guessed(case, chosen, ahead, borne, taken_off(case, fitted.moved, noise), over)
    else:
        reason = _reason(case, chosen, held, explained, borne, _unfit(case, fitted, noise), over)
    if worse and reason == "named":
        reason = "refuted"
    if reason == "faint":
        return nothing(case, laws, borne)
    verdict = "named" if reason == "named" else "unexplained"
    others = others if verdict == "named" else ()
    if others:
        verdict = "equivalence class"
    if verdict == "unexplained":
        # What explains little, or is not believed, is no more probable than that, and all other laws with it.
        explained = min(explained, 1 - chosen.left, max(borne, 0.0))
        most = float(np.clip(explained / 2, 0.0, 0.45))
        if reason == "unconfirmed":
            most = 0.45
        scale = min(1.0, most / max(max(chances.values()), 1e-12))
        chances = {t: scale * chance for t, chance in chances.items()}
        if not chosen.enough:
            # What the frames hardly speak for explains nothing that can be told from noise.
            explained = 0.0
    # A law that is named beside another is as probable as that, not as it would be in the other's stead.
    chances |= {r.term: min(alone(r), chances[term]) for r in fitted.refits[1:]}
    after = fitted.moved if verdict != "unexplained" else case.base.simulated
    return Judgement(verdict, reason, chosen, chances, explained, after, noise, borne, over, others)


def stands(tried: list[Explanation]) -> Explanation:
    """The first of them that is not refuted; one that is not the best must be confirmed."""
    for n, each in enumerate(tried):
        if each.sound and (n == 0 or each.confirmed):
            return each
    return tried[0]


def likeness(case: Case) -> float:
    """|cos| of whitened responses beyond which two laws do the same."""
    return calibration.ALIKE_GUESSED if guessed(case) else calibration.ALIKE


def alike(case: Case, chosen: Explanation, tried: list[Explanation], chances: dict[str, float]) -> tuple[Refit, ...]:
    """What a single law of a video may be instead: others that move a guessed body nearly as it does."""
    if len(chosen.fitted.refits) > 1:
        return ()
    near = [r for r in _rivals(chosen, tried) if cos(case, chosen.first, r) > likeness(case)]
    return tuple(sorted(near, key=lambda r: -chances[r.term]))


def _rivals(chosen: Explanation, tried: list[Explanation]) -> list[Refit]:
    """Single laws of another name that nothing speaks against."""
    return [e.first for e in tried if e.first.term != chosen.first.term and len(e.fitted.refits) == 1 and e.sound]


def instead(chosen: Explanation, tried: list[Explanation], chances: dict[str, float]) -> tuple[Refit, ...]:
    """What a single law may be instead: the most probable others that nothing speaks against.

    With it they are a credible set, the fewest laws that hold calibration.CREDIBLE of the probability; none of them has
    less than what would be left outside.
    """
    if len(chosen.fitted.refits) > 1:
        return ()
    least, held, found = 1 - calibration.CREDIBLE, chances[chosen.first.term], []
    for law in sorted(_rivals(chosen, tried), key=lambda r: -chances[r.term]):
        if held > calibration.CREDIBLE or chances[law.term] < least:
            break
        found.append(law)
        held += chances[law.term]
    return tuple(found)


def simplest(case: Case, chosen: Explanation, tried: list[Explanation], chances: dict[str, float]) -> Explanation:
    """The explanation itself, or one of fewer numbers that does the same and is hardly less probable.

    A law with a free direction fits what another leaves wrong as well as what is there; where both say the same of the
    tissue, that the freer one gains a little more is no reason to prefer it.
    """
    size = chosen.first.finding.hypothesis.mix.shape[1]
    for each in tried:
        fewer = each.first.finding.hypothesis.mix.shape[1] < size
        sound = len(each.fitted.refits) == len(chosen.fitted.refits) == 1 and each.sound
        near = chances[each.first.term] > calibration.NEAR * chances[chosen.first.term]
        if fewer and sound and near and cos(case, chosen.first, each.first) > likeness(case):
            return each
    return chosen


def _unfit(case: Case, fitted: Joint, noise: Noise) -> bool:
    """Whether frames held out are farther off than a recording is beside what it holds, camera and video aside."""
    left = rms(case, as_filmed(case, fitted.moved))[1]
    return left is not None and left > calibration.UNFIT * noise_floor(noise)


def _reason(
    case: Case, chosen: Explanation, held: float, explained: float, borne: float, unfit: bool, over: Gain | None
) -> str:
    """Why it is named, or not; held: its probability among all laws, with those that it may be instead."""
    free = not case.settings.calibrated
    clear = free or chosen.log_evidence >= calibration.CLEAR
    seen = free or borne >= calibration.BORNE_OUT or (borne > 0 and chosen.foretold)
    # What the plain error does not bear out and is contradicted by frames held out is not certain to be anything,
    # unless the fitted ones leave no doubt.
    sure = clear and (seen or chosen.support >= calibration.CLEAR)
    certain = case.overstretched or sure or chosen.log_evidence >= calibration.CERTAIN
    if not certain and not seen:
        return "faint"
    if chosen.loose:
        return "loose"
    if chosen.drawn:
        return "drawn"
    # A smooth field follows what grid and mesh have wrong too: what frames held out confirm need not explain all of it.
    much = explained >= calibration.EXPLAINED or chosen.confirmed
    little = not much or not (free or chosen.enough)
    doubts = {"refuted": chosen.refuted, "unbacked": not seen, "little": little, "unfit": unfit}
    doubt = next((reason for reason, holds in doubts.items() if holds), None)
    if doubt:
        # What is not believed says that something is hidden only where that is certain.
        return doubt if certain else "faint"
    if chosen.visible and not (chosen.confirmed or chosen.as_promised):
        return "unconfirmed"
    if not (chosen.visible or chosen.confirmed or clear) and held < calibration.SURE:
        # The fitted frames alone speak, and not for it alone.
        return "unconfirmed"
    if over is not None and over.refuted:
        return "beaten"
    return "named"


def guessed(case: Case) -> bool:
    """Whether body and grips were read off a video."""
    return case.clip.recording.guessed


def _reason_guessed(
    case: Case, chosen: Explanation, ahead: bool, borne: float, later: float | None, over: Gain | None
) -> str:
    """The same of a video; ahead: whether it, with what it may be instead, is far more probable than any other law;
    later: what errors.taken_off says of it.

    What a guessed body gets wrong is larger than noise and told from it; a law explains little of it, and nothing is
    said then. One that is there takes most of the misfit away, also in frames held out, but not all of it; where those
    are off by no more than noise, the plain error of the fitted ones must bear it out. What a law takes away that no
    smooth motion could is single tracks' own.
    """
    if not case.clip.held[: case.clip.until].any():
        return "ungrasped"
    free = not case.settings.calibrated
    certain = free or chosen.log_evidence >= calibration.CLEAR
    seen = free or later is not None or borne >= calibration.BORNE_OUT
    most = min(1 - chosen.left, chosen.smooth)
    if not (certain and seen and chosen.enough and most >= calibration.HALF):
        return "faint"
    doubts = {
        "drawn": chosen.drawn,
        "refuted": chosen.refuted,
        "unfit": later is not None and later < calibration.HALF,
        "unconfirmed": not ahead,
        "beaten": over is not None and over.refuted,
    }
    return next((reason for reason, holds in doubts.items() if holds), "named")


def nothing(case: Case, laws: Scores, borne: float | None = None) -> Judgement:
    """Where no law says what noise and nuisances do not; borne: `borne_out` of the best law, where it was run."""
    plain = case.base.simulated
    top = best(laws)
    logs = {term: score.evidence / calibration.TEMPERATURE for term, score in laws.items()}
    chances = _shares(logs, max(0.0, calibration.THRESHOLD - top) / 4)
    if borne is not None:
        scale = min(1.0, max(borne, 0.0) / 2 / max(chances.values()))
        chances = {term: scale * chance for term, chance in chances.items()}
    return Judgement("nothing detectable", "faint", None, chances, 0.0, plain, noise_beside(case, plain), borne)


def probabilities(laws: Scores, tried: list[Explanation], misfit: float = calibration.MISFIT) -> dict[str, float]:
    """Law -> probability; what is missing to 1 is nothing, or a law that nobody thought of.

    misfit: share of the explained chi square that signatures of the right law leave wrong.
    """
    best = max(e.fitted.gain for e in tried)
    heat = calibration.temperature(calibration.TEMPERATURE, best, misfit)
    logs = {term: score.evidence for term, score in laws.items()}
    run: dict[str, float] = {}
    for e in tried:
        run[e.first.term] = max(e.support, run.get(e.first.term, -np.inf))
    logs = {term: value / heat for term, value in (logs | run).items()}
    return _shares(logs, calibration.THRESHOLD / heat)


def _shares(logs: dict[str, float], none: float) -> dict[str, float]:
    scale = max(*logs.values(), none)
    weight = {term: np.exp(value - scale) for term, value in logs.items()}
    whole = sum(weight.values()) + np.exp(none - scale)
    return {term: float(w / whole) for term, w in weight.items()}


def alone(r: Refit) -> float:
    """Probability of a law for itself, beside what else is named."""
    heat = calibration.temperature(calibration.TEMPERATURE, r.gain)
    return float(expit((r.log_evidence - calibration.THRESHOLD) / heat))


def pushes(recording, accepted: list[Refit]) -> list[tuple[float, Hypothesis]]:
    """Unseen pushes among laws, and how far they point out of the tissue."""
    mine = [r for r in accepted if candidates.of(r.finding.hypothesis).presses]
    found = [(r.finding.hypothesis, r.amplitude) for r in mine]
    return [(outward(recording, h.place, amplitude), h) for h, amplitude in found]


def pays(case: Case, one: Joint, both: Joint) -> bool:
    """Whether a second law fitted together with the first says enough to be named beside it."""
    rest, left = (still(case, t.moved) for t in (one, both))
    return left < (1 - calibration.SECOND) * rest and 0.5 * (both.gain - one.gain) > least(one)


def still(case: Case, after: np.ndarray) -> float:
    """Share of what a smooth field could explain that is left beside a prediction."""
    clip = case.clip
    z = case.z - case.whiten(after[:, : clip.until] - case.base.simulated[:, : clip.until])
    return float(np.clip(explainable(case.saturated.fit(z)) / max(explainable(case.smooth), 1e-9), 0, 1))


def explainable(smooth: SmoothFit) -> float:
    """chi square that a smooth field gains beyond what it gains on nearly all residuals of nothing."""
    return max(smooth.gain - smooth.slack, 0.0)


def cos(case: Case, a: Refit, b: Refit) -> float:
    """Likeness of two laws' whitened responses, beside everything that is no physics."""
    until = case.clip.until
    white = np.stack([case.whiten(r.response[:, :until]) for r in (a, b)], 1)
    G = case.space.gram(white, white)
    return float(abs(G[0, 1]) / np.sqrt(max(G[0, 0] * G[1, 1], 1e-30)))


def noise_beside(case: Case, after: np.ndarray) -> Noise:
    """The noise with an effect taken off: then quiet frames show it alone."""
    clip, quiet = case.clip, slice(0, case.clip.until)
    found = estimate(
        residual(case, after, False, whole=True)[:, quiet], clip.seen[:, quiet], clip.rest, clip.quiet()[quiet],
        *clip.nominal, untouched=clip.untouched,
    )  # fmt: skip
    return replace(found, rough=case.noise.rough)


def borne_out(case: Case, after: np.ndarray) -> float:
    """How much of what a prediction changes the plain error of the fitted frames bears out, nuisances aside.

    By how much its mean square falls, over that of the change, each beside the nuisances that are likeliest with it: 1
    where what is added is there (more where it is there more strongly), -1 where nothing of the kind is, whatever noise
    is taken to do in directions that it hardly reaches.
    """
    until = case.clip.until
    both = (beside_nuisances(case, s) for s in (case.base.simulated, after))
    before, left = (residual(case, s, False, rest_only=False)[:, :until] for s in both)
    change = float(((before - left) ** 2).sum())
    return float((before**2).sum() - (left**2).sum()) / change if change > 0 else -1.0


def reordered(refits: list[Refit], chosen: Explanation) -> list[Refit]:
    """Laws with the chosen one first."""
    return [chosen.first, *(r for r in refits if r.term != chosen.first.term)]
