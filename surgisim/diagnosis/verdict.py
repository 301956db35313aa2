"""From fits to a verdict: probabilities, intervals, held-out errors, and what is said in words."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit

from surgisim.artifacts.diagnosis import ALIKE, Diagnosis
from surgisim.artifacts.mismatch import Mismatch
from surgisim.artifacts.physics import Physics
from surgisim.diagnosis import calibration, candidates, words
from surgisim.diagnosis.clip import PHASES
from surgisim.diagnosis.contact import outward
from surgisim.diagnosis.errors import errors, residual, rms
from surgisim.diagnosis.experiment import separating
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.laws import described, law_of
from surgisim.diagnosis.locate import cause, of_places, symptom
from surgisim.diagnosis.markers import largest, markers
from surgisim.diagnosis.model import base_numbers, physics
from surgisim.diagnosis.noise import Noise, estimate
from surgisim.diagnosis.placebo import placebo
from surgisim.diagnosis.replay import Replay, replayed
from surgisim.diagnosis.together import Together, least

RUNNERS = 4
"""Other laws that an effect lists."""


@dataclass(frozen=True)
class Judgement:
    """What is said of a recording, before it is written down."""

    verdict: str
    accepted: list
    """Laws that say something, best first."""
    chances: dict[str, float]
    effects: list[dict]
    explained: float
    """Share of what physics could explain."""
    after: np.ndarray
    """Displacement of the points with what is named [m], (K, T, 3)."""
    noise: Noise
    shares: dict[str, float | None]

    @property
    def named(self) -> bool:
        return self.verdict in ("named", "equivalence class")


def judged(case, laws, refits, fitted: Together, bend, over_placebo: float | None = None) -> Judgement:
    """Where something is detected. refits: best first; fitted: what may be named of them, and what else.

    over_placebo: held-out error of a placebo less that of what is named [mm]; None where there is none.
    """
    chances, first = probabilities(laws, refits, True), refits[0]
    total = max(explainable(bend), *(r.gain for r in refits), 1e-9)
    accepted, after = fitted.refits, fitted.moved
    explained = min(sum(r.gain for r in accepted) / total, 1.0)
    alike = [r for r in refits[1:] if _cos(case, first, r) > calibration.ALIKE and chances[r.term] > 0.1]
    noise = noise_beside(case, after)
    shares = {
        "gained": float(explained),
        "taken": taken(case, after, noise.sigma),
        "left": still(case, bend, after),
        "gain": fitted.gain,
        "predicted": predicted(case, after, noise.sigma),
        "outward": max((out for out, _ in pushes(case.clip.recording, accepted)), default=None),
        "over_placebo": over_placebo,
    }
    if case.settings.calibrated and not case.strained and faint(first.log_evidence, shares):
        return nothing(case, laws, shares)
    explained = max(shares["gained"], shares["taken"])
    verdict = "named"
    if doubtful(first.term, shares):
        verdict, explained = "unexplained", min(explained, 1 - shares["left"])
    elif first.log_evidence < calibration.THRESHOLD:
        # Small patterns that it gains say nothing: what it takes off the error does.
        verdict, explained = "unexplained", shares["taken"]
    elif explained < calibration.EXPLAINED:
        verdict = "unexplained"
    elif alike and chances[first.term] < calibration.SURE:
        verdict = "equivalence class"
    # What explains little, or is not believed, is no more probable than that, and all other laws with it.
    most = 1.0 if verdict != "unexplained" else float(np.clip(explained / 2, 0.0, 0.45))
    scale = min(1.0, most / max(chances[first.term], 1e-12))
    chances = {term: scale * chance for term, chance in chances.items()}
    effects = [_effect(case, r, chances, {a.term for a in accepted}, n) for n, r in enumerate(accepted)]
    for effect in effects:
        effect["probability"] = min(effect["probability"], most)
    # A law that is named beside another is as probable as that, not as it would be in the other's stead.
    chances |= {effect["term"]: effect["probability"] for effect in effects[1:]}
    if verdict == "unexplained":
        # What is not believed is not modelled.
        after = case.base.simulated
    return Judgement(verdict, accepted, chances, effects, float(explained), after, noise, shares)


def nothing(case, laws, shares: dict[str, float | None]) -> Judgement:
    """Where no law says what noise and the simulator's own error do not; shares: the best law's, where it was run."""
    plain = case.base.simulated
    chances = probabilities(laws, [], False)
    if shares:
        scale = min(1.0, shares["taken"] / 2 / max(chances.values()))
        chances = {term: scale * chance for term, chance in chances.items()}
    return Judgement("nothing detectable", [], chances, [], 0.0, plain, noise_beside(case, plain), shares)


def faint(evidence: float, shares: dict[str, float | None]) -> bool:
    """Whether what the best law gains is no more than the simulator's own error may feign.

    Its evidence is that of small patterns that stand out of a small expected error; the misfit stays as it was.
    """
    return evidence < calibration.CLEAR and shares["taken"] < calibration.TAKEN


def write(
    case, laws, ranked, refits, fitted: Together | None, bend, say: Callable[[str], None]
) -> tuple[Diagnosis, Physics, Mismatch]:
    """Everything a diagnosis leaves behind. refits: best first; fitted: of them what may be named, None for nothing."""
    clip, base = case.clip, case.base
    rng = np.random.default_rng([case.settings.seed, 1])
    said_of = nothing(case, laws, {}) if fitted is None else judged(case, laws, refits, fitted, bend)
    shown = Replay(clip, base.simulated, said_of.after, None)
    if said_of.named:
        say("a placebo, and what is named on a finer grid")
        shown = beside_placebo(case, fitted, placebo(case, fitted, refits, laws))
        said_of = judged(case, laws, refits, fitted, bend, over_placebo(case, shown))
        if not said_of.named:
            shown = replace(shown, after=shown.before, placebo=None)
    verdict, effects, chances, named = said_of.verdict, said_of.effects, said_of.chances, said_of.named
    noise, explained = said_of.noise, said_of.explained
    fit, held_out = errors(case, shown.before, shown.after, shown.placebo, noise.sigma)
    say("verdict")
    z, reach = symptom(clip, noise, residual(case, base.simulated, False, rest_only=False), rng)
    freed = case.z - case.space.explained(case.z)
    cleared = case.nulls - case.space.explained(case.nulls)
    heat, when = cause(base, case.whiten, freed, cleared)
    heat = heat / max(heat.max(), 1e-30)
    if effects and refits[0].finding.hypothesis.place is not None and refits[0].finding.hypothesis.place.normal is None:
        scope = refits[0].finding.hypothesis.scope
        alike = [f for f in laws[refits[0].term][2] if f.hypothesis.scope == scope]
        heat = of_places(clip, alike, base.prepared.simulator.rest)
    if named and case.settings.experiment and len(refits) > 1:
        pair = [law_of(r.finding.hypothesis, r.amplitude, clip) for r in refits[:2]]
        effects[0]["separating_experiment"] = separating(
            clip, base, *pair, case.memo, (refits[0].term, refits[1].term), rng, case.workers
        )
    said = _words(case, said_of, refits, laws, z, held_out)
    above = detectable(case, laws)
    diagnosis = Diagnosis(
        recording=clip.recording.name,
        verdict=verdict,
        effects=effects,
        ranking=_ranking(case, laws, ranked, refits, chances),
        detectable_above={"value": above[0], "unit": "mm", "laws": above[1]},
        missing_phases=missing(clip),
        fit=fit,
        held_out=held_out,
        unexplained_fraction=float(np.clip(1 - explained, 0, 1)) if verdict != "nothing detectable" else 0.0,
        words=said,
        markers=markers(verdict, effects, clip, z),
        base=base_numbers(base),
        noise={k: (float(v) if np.ndim(v) == 0 else float(np.mean(v))) for k, v in vars(noise).items()}
        | {"sigma": noise.sigma, "unit": "m"},
        global_test={
            "log_evidence": float(laws[ranked[0]][0]),
            "nulls": np.round(np.max([n for _, n, _ in laws.values()], 0), 3).tolist(),
            "explainable": float(explainable(bend)),
            "strain": case.strain,
            **said_of.shares,
            "spacing": {"value": float(1e3 * shown.clip.body.spacing), "unit": "mm"},
            "beside": None if fitted is None or fitted.beside is None else _beside(case, bend, fitted.beside),
        },
    )
    mismatch = Mismatch(
        points=clip.rest,
        residual_before=residual(case, shown.before),
        residual_after=residual(case, shown.after),
        z=z,
        significant=reach,
        particles=base.prepared.simulator.rest,
        cause=heat,
        cause_time=np.concatenate([when, np.zeros(clip.frames - clip.until)]),
        phase=clip.phases(),
    )
    return diagnosis, physics(replace(case, clip=shown.clip), said_of.accepted if named else []), mismatch


def beside_placebo(case, fitted: Together, wrong: Together | None) -> Replay:
    """What is shown of what is named: on a finer grid, where the engine bears it."""
    as_searched = Replay(case.clip, case.base.simulated, fitted.moved, None if wrong is None else wrong.moved)
    return replayed(case, fitted, wrong) or as_searched


def over_placebo(case, shown: Replay) -> float | None:
    """Held-out error of the placebo less that of what is named [mm]; None where one is missing."""
    if shown.placebo is None:
        return None
    named, wrong = (rms(case, moved)[1] for moved in (shown.after, shown.placebo))
    return None if named is None else wrong - named


def noise_beside(case, after: np.ndarray) -> Noise:
    """The noise with an effect taken off: then quiet frames show it alone."""
    clip, quiet = case.clip, slice(0, case.clip.until)
    return estimate(
        residual(case, after, False)[:, quiet], clip.seen[:, quiet], clip.rest, clip.quiet()[quiet],
        clip.recording.sigma[clip.kept],
    )  # fmt: skip


def taken(case, after: np.ndarray, sigma: float) -> float:
    """Share of the misfit's mean square beyond the noise that a prediction takes away on fitted frames."""
    least = 3e6 * sigma**2
    before, left = (rms(case, s)[0] ** 2 - least for s in (case.base.simulated, after))
    return float(np.clip(1 - left / before, 0, 1)) if before > 0 else 0.0


def predicted(case, after: np.ndarray, sigma: float) -> float | None:
    """Share of the misfit's mean square beyond the noise that a prediction takes away on frames held out.

    None where none are held out, or where nothing stands out of the noise there without it.
    """
    least = 3e6 * sigma**2
    before, left = (rms(case, s)[1] for s in (case.base.simulated, after))
    if before is None or before**2 < calibration.SHOWS**2 * least:
        return None
    return float(1 - (left**2 - least) / (before**2 - least))


def doubtful(term: str, shares: dict[str, float | None]) -> bool:
    """Whether a law that explains enough is not to be believed all the same.

    A push of free place, direction and course follows whatever comes and goes: only where it leaves next to nothing is
    it one, and only where it presses on a surface; what draws tissue outward holds it. And no law is believed that
    leaves a large misfit on other frames as it was, or that a placebo beats there.
    """
    loose = candidates.catalogue()[term].free_course and shares["left"] > calibration.PUSH_LEAVES
    return loose or draws(shares) or beaten(shares) or idle(shares)


def draws(shares: dict[str, float | None]) -> bool:
    """Whether an unseen push that would be named draws tissue out of its surface, as no contact can."""
    return shares["outward"] is not None and shares["outward"] > calibration.PULLS


def idle(shares: dict[str, float | None]) -> bool:
    """Whether a large misfit on the frames held out stays as it was."""
    return shares["predicted"] is not None and shares["predicted"] < calibration.PREDICTED


def beaten(shares: dict[str, float | None]) -> bool:
    """Whether a placebo foretells the frames held out better, by however little that can be told."""
    return shares["over_placebo"] is not None and shares["over_placebo"] < -ALIKE


def pushes(recording, accepted: list) -> list[tuple[float, Hypothesis]]:
    """Unseen pushes among laws, and how far they point out of the tissue."""
    mine = [r for r in accepted if candidates.of(r.finding.hypothesis).presses]
    found = [(r.finding.hypothesis, r.amplitude) for r in mine]
    return [(outward(recording, h.place, amplitude), h) for h, amplitude in found]


def pays(case, bend, one: Together, both: Together) -> bool:
    """Whether a second law fitted together with the first says enough to be named beside it."""
    rest, left = (still(case, bend, t.moved) for t in (one, both))
    return left < (1 - calibration.SECOND) * rest and 0.5 * (both.gain - one.gain) > least(one)


def still(case, bend, after: np.ndarray) -> float:
    """Share of what a smooth field could explain that is left beside a prediction."""
    clip = case.clip
    z = case.z - case.whiten(after[:, : clip.until] - case.base.simulated[:, : clip.until])
    return explainable(case.flexible.fit(z)) / max(explainable(bend), 1e-9)


def explainable(bend) -> float:
    """chi square that a smooth field gains beyond what it gains where nothing is hidden."""
    return max(bend.gain - calibration.SLACK, 0.0)


def probabilities(laws: dict, refits: list, detected: bool) -> dict[str, float]:
    """Law -> probability; what is missing to 1 is nothing, or a law that nobody thought of."""
    if not detected:
        top = max(laws.values(), key=lambda entry: entry[0])[0]
        logs = {term: entry[0] / calibration.TEMPERATURE for term, entry in laws.items()}
        none = max(0.0, calibration.THRESHOLD - top) / 4
    else:
        logs = {term: entry[0] for term, entry in laws.items()}
        logs |= {r.term: r.log_evidence for r in refits}
        best = max(r.gain for r in refits)
        heat = calibration.TEMPERATURE + calibration.MISFIT * max(best, 0.0)
        logs = {term: value / heat for term, value in logs.items()}
        none = calibration.THRESHOLD / heat
    scale = max(*logs.values(), none)
    weight = {term: np.exp(value - scale) for term, value in logs.items()}
    whole = sum(weight.values()) + np.exp(none - scale)
    return {term: float(w / whole) for term, w in weight.items()}


def detectable(case, laws: dict) -> tuple[float, dict[str, float]]:
    """RMS sizes [mm] at which the best hypothesis of each law would reach the threshold, and their median."""
    result = {}
    for term, (_, _, findings) in laws.items():
        f = findings[0]
        if f.size > 0 and f.gain > 0:
            result[term] = float(1e3 * f.size * np.sqrt(2 * (calibration.THRESHOLD + 4) / f.gain))
    return (float(np.median(list(result.values()))) if result else float("nan")), result


def missing(clip) -> list[str]:
    """Phases that the fitted frames lack, without which some laws cannot be told."""
    present = {PHASES[k] for k in np.unique(clip.phases()[: clip.until])}
    return [name for name in PHASES if name not in present]


def _effect(case, r, chances, named: set[str], number) -> dict:
    h: Hypothesis = r.finding.hypothesis
    # Of a blob the radius at which it is down to a half; a grip's own radius.
    reach = 1.0 if candidates.of(h).exact_extent else np.sqrt(2 * np.log(2))
    others = sorted((t for t in chances if t not in named), key=lambda t: -chances[t])
    runners = [{"term": t, "probability": chances[t]} for t in others]
    local = h.place is not None and h.place.normal is None
    place: dict | str = "everywhere"
    if local:
        place = {"center": [float(c) for c in h.place.center], "extent": float(reach * h.place.extent), "unit": "m"}
    heat = calibration.TEMPERATURE + calibration.MISFIT * max(r.gain, 0.0)
    alone = float(expit((r.log_evidence - calibration.THRESHOLD) / heat))
    return {
        "term": r.term,
        "probability": chances[r.term] if number == 0 else alone,
        "place": place,
        "time": {"onset": None if h.onset is None else float(h.onset), "end": None if h.end is None else float(h.end)},
        "parameters": described(h, r.amplitude, r.finding.spread, case.clip, case.base, r.draws),
        "runners_up": runners[:RUNNERS],
        "separating_experiment": "",
        "log_evidence": float(r.log_evidence),
        "size": {"value": float(1e3 * r.finding.size), "unit": "mm"},
    }


def _beside(case, bend, other: Together) -> dict:
    return {
        "laws": [r.term for r in other.refits],
        "gain": other.gain,
        "left": still(case, bend, other.moved),
        "held_out_rms": rms(case, other.moved)[1],
    }


def _cos(case, a, b) -> float:
    until = case.clip.until
    white = np.stack([case.whiten(r.response[:, :until]) for r in (a, b)], 1)
    G = case.space.gram(white, white)
    return float(abs(G[0, 1]) / np.sqrt(max(G[0, 0] * G[1, 1], 1e-30)))


def _ranking(case, laws, ranked, refits, chances) -> list[dict]:
    run = {r.term: r for r in refits}
    order = sorted(ranked, key=lambda t: -chances[t])
    result = []
    for term in order:
        f = laws[term][2][0]
        place = f.hypothesis.place
        r = run.get(term)
        held = None
        if r is not None and case.clip.frames > case.clip.until:
            held = rms(case, case.base.simulated + r.response)[1]
        result.append(
            {
                "term": term,
                "place": "everywhere"
                if place is None
                else {"center": [float(c) for c in place.center], "extent": float(place.extent), "unit": "m"},
                "log_evidence": float(laws[term][0] if r is None else r.log_evidence),
                "probability": chances[term],
                "gain": float(f.gain if r is None else r.gain),
                "cos": None if r is None else _cos(case, refits[0], r),
                "held_out_rms": held,
                "onset": f.hypothesis.onset,
                "refitted": r is not None,
            }
        )
    return result


def _words(case, said_of: Judgement, refits, laws, z, held_out: dict) -> str:
    verdict, explained = said_of.verdict, said_of.explained
    if verdict == "nothing detectable":
        before, noise = held_out["before"], held_out["noise_floor"]
        later = (before, noise) if before is not None and before > calibration.SHOWS * noise else None
        return words.nothing(1e-3 * detectable(case, laws)[0], later)
    if verdict == "unexplained" and draws(said_of.shares) and said_of.shares["left"] <= calibration.PUSH_LEAVES:
        push = max(pushes(case.clip.recording, said_of.accepted), key=lambda push: push[0])[1]
        number = next(n for n, r in enumerate(said_of.accepted, 1) if r.finding.hypothesis is push)
        return words.drawn(push, number)
    if verdict == "unexplained":
        best = refits[0].term
        k, t = largest(z, case.clip.until)
        when = f"at {t / case.clip.fps:.2g} s ({PHASES[case.clip.phases()[t]]})"
        where = case.clip.rest[k].tolist()
        if beaten(said_of.shares):
            return words.beaten(best, 1e3 * said_of.shares["over_placebo"], when, where)
        if idle(said_of.shares):
            return words.idle(best, when, where)
        return words.unexplained(best, 1 - explained, when, where)
    found = zip(said_of.accepted, said_of.effects, strict=True)
    said = words.sentence([(r.finding.hypothesis, e["parameters"], r.finding.size) for r, e in found], explained)
    if verdict == "equivalence class":
        said += f" {said_of.effects[0]['runners_up'][0]['term']} would look nearly the same."
    return said
