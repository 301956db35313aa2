"""From fits to a verdict: probabilities, intervals, held-out errors, and what is said in words."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from surgisim.artifacts.diagnosis import Diagnosis
from surgisim.artifacts.mismatch import Mismatch
from surgisim.artifacts.physics import Physics
from surgisim.diagnosis import calibration, words
from surgisim.diagnosis.clip import PHASES
from surgisim.diagnosis.context import Case
from surgisim.diagnosis.errors import as_filmed, errors, residual, rms
from surgisim.diagnosis.evidence import highest
from surgisim.diagnosis.experiment import separating
from surgisim.diagnosis.foretold import of_laws
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.joint import Joint
from surgisim.diagnosis.judgement import (
    Explanation,
    Judgement,
    cos,
    explainable,
    explanations,
    guessed,
    judged,
    nothing,
    pushes,
    reordered,
    still,
)  # fmt: skip
from surgisim.diagnosis.laws import described, law_of
from surgisim.diagnosis.left_open import goodness, nuisances, told
from surgisim.diagnosis.locate import cause, of_places, symptom
from surgisim.diagnosis.markers import largest, markers
from surgisim.diagnosis.model import base_numbers, physics
from surgisim.diagnosis.placebo import placebo
from surgisim.diagnosis.replay import Replay, replayed
from surgisim.diagnosis.residual.model import modelled
from surgisim.diagnosis.said import place_of, time_of

RUNNERS = 4
"""Other laws that an effect lists."""


def write(
    case, laws, ranked, refits, fitted: Joint | None, say: Callable[[str], None]
) -> tuple[Diagnosis, Physics, Mismatch]:
    """Everything a diagnosis leaves behind. refits: best first; fitted: of them what may be named, None for nothing."""
    clip, base = case.clip, case.base
    rng = np.random.default_rng([case.settings.seed, 1])
    tried = [] if fitted is None else explanations(case, refits, fitted)
    said_of = judged(case, laws, tried) if tried else nothing(case, laws)
    shown = Replay(clip, base.simulated, said_of.after, None)
    if said_of.chosen is not None:
        refits, fitted = reordered(refits, said_of.chosen), said_of.chosen.fitted
    if said_of.named:
        say("a placebo, and what is named on a finer grid")
        wrong = placebo(case, fitted, refits, laws)
        over = None
        if wrong is not None and case.prospect is not None:
            known = fitted.refits[0].known
            over = case.prospect.gain(*(of_laws(case, t.refits, t.moved, known) for t in (wrong, fitted)))
        shown = beside_placebo(case, fitted, wrong)
        said_of = judged(case, laws, tried, over, worse(case, shown))
        if not said_of.named:
            shown = replace(shown, after=shown.before, placebo=None)
    verdict, chances, named = said_of.verdict, said_of.chances, said_of.named
    if verdict == "unexplained":
        left = max(explainable(case.smooth), said_of.chosen.fitted.gain)
        case = replace(case, base=replace(base, known=base.known.beside(left, case.clip.prior)))
    members = [*said_of.accepted, *said_of.others]
    effects = [_effect(case, r, chances, {m.term for m in members}) for r in members]
    noise, explained = said_of.noise, said_of.explained
    on_shown = replace(case, clip=shown.clip)
    fit, held_out = errors(on_shown, shown.before, shown.after, shown.placebo, noise)
    say("verdict")
    z, reach = symptom(clip, noise, residual(case, base.simulated, False, rest_only=False), rng)
    freed = case.z - case.space.explained(case.z)
    cleared = case.nulls - case.space.explained(case.nulls)
    heat, when = cause(base, case.whiten, freed, cleared)
    heat = heat / max(heat.max(), 1e-30)
    if effects and refits[0].finding.hypothesis.place is not None and refits[0].finding.hypothesis.place.normal is None:
        scope = refits[0].finding.hypothesis.scope
        alike = [f for f in laws[refits[0].term].findings if f.hypothesis.scope == scope]
        heat = of_places(clip, alike, base.prepared.simulator.rest)
    if named and case.settings.experiment and len(refits) > 1:
        told_apart = refits[0], (said_of.others or refits[1:])[0]
        pair = [law_of(r.finding.hypothesis, r.amplitude, clip) for r in told_apart]
        names = told_apart[0].term, told_apart[1].term
        effects[0]["separating_experiment"] = separating(clip, base, *pair, case.memo, names, rng, case.workers)
    said = _words(case, said_of, refits, laws, z, held_out)
    unnamed = None
    if verdict == "unexplained" and said_of.reason != "ungrasped" and case.settings.residual:
        unnamed = modelled(case, say)
        said += f" {unnamed.words}"
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
        nuisances=nuisances(case),
        goodness=goodness(case, said_of.after),
        untold=list(case.base.untold),
        forces={} if case.base.pulls is None else case.base.pulls.told(case.base.x),
        as_given=[name for name in case.base.as_given if name in clip.recording.expected],
        base=base_numbers(case.base),
        noise=noise.told() | {"strayed": clip.strayed},
        global_test={
            "log_evidence": float(laws[ranked[0]].evidence),
            "nulls": np.round(highest(laws), 3).tolist(),
            "explainable": float(explainable(case.smooth)),
            "nuisance_ratio": case.nuisance_ratio,
            **_shares(said_of),
            "spacing": {"value": float(1e3 * shown.clip.body.spacing), "unit": "mm"},
            "weighed": [_weighed(e) for e in tried],
            "beside": None if fitted is None or fitted.beside is None else _beside(case, fitted.beside),
        },
        residual={} if unnamed is None else unnamed.told,
    )
    mismatch = Mismatch(
        points=clip.rest,
        residual_before=residual(on_shown, shown.before),
        residual_after=residual(on_shown, shown.after),
        z=z,
        significant=reach,
        particles=base.prepared.simulator.rest,
        cause=heat,
        cause_time=np.concatenate([when, np.zeros(clip.frames - clip.until)]),
        phase=clip.phases(),
    )
    if unnamed is not None and unnamed.helps:
        return diagnosis, physics(replace(case, clip=unnamed.shown.clip), unnamed.refits), mismatch
    return diagnosis, physics(on_shown, said_of.accepted if named else []), mismatch


def worse(case: Case, shown: Replay) -> bool:
    """Whether the error of the frames held out rises with what is named, by more than its interval."""
    on_shown = replace(case, clip=shown.clip)
    high = errors(on_shown, shown.before, shown.after, None, case.noise)[1]["gain_high"]
    return high is not None and high < 0


def _shares(said_of: Judgement) -> dict:
    """Why it says so, in numbers."""
    chosen = said_of.chosen
    told = {"reason": said_of.reason, "explained": said_of.explained, "borne_out": said_of.borne}
    told["over_placebo"] = None if said_of.over_placebo is None else vars(said_of.over_placebo)
    if chosen is None:
        return told
    ahead = None if chosen.ahead is None else vars(chosen.ahead)
    return told | {"gain": chosen.fitted.gain, "left": chosen.left, "outward": chosen.outward, "held_out": ahead}


def _weighed(tried: Explanation) -> dict:
    """One of the explanations that may be named, in numbers."""
    ahead = None if tried.ahead is None else vars(tried.ahead)
    laws = [r.term for r in tried.fitted.refits]
    return {"laws": laws, "log_evidence": tried.log_evidence, "left": tried.left, "held_out": ahead}


def beside_placebo(case, fitted: Joint, wrong: Joint | None) -> Replay:
    """What is shown of what is named: on a finer grid, where the engine bears it."""
    as_searched = Replay(case.clip, case.base.simulated, fitted.moved, None if wrong is None else wrong.moved)
    return replayed(case, fitted, wrong) or as_searched


def detectable(case, laws: dict) -> tuple[float, dict[str, float]]:
    """RMS sizes [mm] at which the best hypothesis of each law would reach the threshold, and their median."""
    result = {}
    for term, score in laws.items():
        f = score.best
        if f.size > 0 and f.gain > 0:
            result[term] = float(1e3 * f.size * np.sqrt(2 * (calibration.THRESHOLD + 4) / f.gain))
    return (float(np.median(list(result.values()))) if result else float("nan")), result


def missing(clip) -> list[str]:
    """Phases that the fitted frames lack, without which some laws cannot be told."""
    present = {PHASES[k] for k in np.unique(clip.phases()[: clip.until])}
    return [name for name in PHASES if name not in present]


def _effect(case: Case, r, chances, named: set[str]) -> dict:
    h: Hypothesis = r.finding.hypothesis
    others = sorted((t for t in chances if t not in named), key=lambda t: -chances[t])
    runners = [{"term": t, "probability": chances[t]} for t in others]
    return {
        "term": r.term,
        "probability": chances[r.term],
        "place": place_of(h),
        "time": time_of(h),
        "parameters": described_of(case, r),
        "runners_up": runners[:RUNNERS],
        "separating_experiment": "",
        "log_evidence": float(r.log_evidence),
        "size": {"value": float(1e3 * r.finding.size), "unit": "mm"},
    }


def _beside(case, other: Joint) -> dict:
    return {
        "laws": [r.term for r in other.refits],
        "gain": other.gain,
        "left": still(case, other.moved),
        "held_out_rms": rms(case, other.moved)[1],
    }


def _ranking(case, laws, ranked, refits, chances) -> list[dict]:
    run = {r.term: r for r in refits}
    order = sorted(ranked, key=lambda t: -chances[t])
    result = []
    for term in order:
        f = laws[term].best
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
                "log_evidence": float(laws[term].evidence if r is None or not r.response.any() else r.log_evidence),
                "probability": chances[term],
                "gain": float(f.gain if r is None else r.gain),
                "cos": None if r is None else cos(case, refits[0], r),
                "held_out_rms": held,
                "onset": f.hypothesis.onset,
                "refitted": r is not None,
            }
        )
    return result


def _words(case: Case, said_of: Judgement, refits, laws, z, held_out: dict) -> str:
    verdict, chosen = said_of.verdict, said_of.chosen
    if verdict == "nothing detectable" and guessed(case):
        return words.guessed(1e-3 * detectable(case, laws)[0]) + words.beside(told(case, said_of.after))
    if verdict == "nothing detectable":
        # What the camera did there is no misfit.
        before, noise = rms(case, as_filmed(case, said_of.after))[1], held_out["noise_floor"]
        later = (before, noise) if before is not None and before > calibration.SHOWS * noise else None
        return words.nothing(1e-3 * detectable(case, laws)[0], later) + words.beside(told(case, said_of.after))
    if said_of.named:
        found = [(r, described_of(case, r)) for r in chosen.fitted.refits]
        said = words.sentence([(r.finding.hypothesis, p, r.finding.size) for r, p in found], said_of.explained)
        if verdict == "equivalence class":
            said += words.instead([(r.term, said_of.chances[r.term]) for r in said_of.others])
        if chosen.ahead is not None and not chosen.visible:
            said += " The frames held out cannot show it."
        return said + words.beside(told(case, said_of.after))
    if said_of.reason == "drawn":
        push = max(pushes(case.clip.recording, chosen.fitted.refits), key=lambda push: push[0])[1]
        number = next(n for n, r in enumerate(chosen.fitted.refits, 1) if r.finding.hypothesis is push)
        return words.drawn(push, number)
    k, t = largest(z, case.clip.until)
    when = f"at {t / case.clip.fps:.2g} s ({PHASES[case.clip.phases()[t]]})"
    where = case.clip.rest[k].tolist()
    left = 1 - said_of.explained if said_of.reason == "little" else chosen.left
    return words.unbelieved(
        said_of.reason, chosen.first.term, said_of.chances[chosen.first.term], left, when, where
    ) + words.beside(told(case, said_of.after))


def described_of(case: Case, r) -> dict[str, dict]:
    """A law's parameters as diagnosis.json has them."""
    return described(r.finding.hypothesis, r.amplitude, r.finding.spread, case.clip, case.base, r.draws)
