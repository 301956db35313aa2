"""The whole diagnosis of one recording: base, noise, search, refits, verdict (docs/diagnosis.md)."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from surgisim.artifacts.diagnosis import Diagnosis
from surgisim.artifacts.mismatch import Mismatch
from surgisim.artifacts.physics import Physics
from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis import calibration, evidence, judgement, nuisance, verdict
from surgisim.diagnosis.base import HELD, Base
from surgisim.diagnosis.base_fit import fit_base, settled
from surgisim.diagnosis.candidates import Parts, costly
from surgisim.diagnosis.clip import Clip, clip_of
from surgisim.diagnosis.context import Case, nulls, workers
from surgisim.diagnosis.evidence import Finding, Scores, by_law
from surgisim.diagnosis.foretold import of_base, of_laws
from surgisim.diagnosis.joint import Joint, fit_jointly, needed
from surgisim.diagnosis.laws import IMPOSSIBLE, law_of, respond
from surgisim.diagnosis.memo import Memo
from surgisim.diagnosis.metric import metric
from surgisim.diagnosis.noise import Whitener, whitener
from surgisim.diagnosis.noise_fit import by_frame, estimate
from surgisim.diagnosis.nuisance import Group
from surgisim.diagnosis.refit import Refit, fit_of_a_law, freed, refit
from surgisim.diagnosis.search import search, sharpened, threshold
from surgisim.diagnosis.single_track import single_track
from surgisim.estimation.trial import at_once
from surgisim.mpm.simulator import Breakdown
from surgisim.problem import Problem
from surgisim.recordings.recording import Recording

Progress = Callable[[float, float, str], None]
MOST_HELD = 4e-3
"""How far what is held may end from where its box does [m]."""
STEADIER = 1.25
"""Times the drift that rest shows beyond which the one that all frames ask for is another; chosen."""
MORE = 1.5
"""Times the drift that a base was fitted beside beyond which it is fitted again; chosen."""
NEAR = 0.25
"""Prior standard deviations of a base's numbers within which other grips change its tracks by the same; chosen."""
MOST_LEFT_OUT = 3
"""Tracks at most that are left out since they alone ask for a law; chosen."""
FIRSTS = 2
"""Laws beside which a second one is looked for."""


def diagnose(
    recording: Recording, settings: Diagnosing, progress: Progress, memo: Memo, single: int = MOST_LEFT_OUT
) -> tuple[Diagnosis, Physics, Mismatch]:
    """What the recording's simulation lacks. Raises Problem where the recording cannot be used.

    single: how many tracks that alone ask for a law may still be left out.
    """
    asked, runs = settings, memo
    case, findings = first_look(recording, settings, memo, progress)
    if hazy(case, by_law(findings)) and settings.replay < settings.grid:
        finer = settings.model_copy(update={"grid": settings.replay})

        def again(share: float, whole: float, text: str) -> None:
            progress(max(share, 0.64), whole, f"{text}, on a finer grid")

        case, findings = first_look(recording, finer, memo.on(finer.grid), again)
    clip, settings, memo = case.clip, case.settings, case.memo
    laws = by_law(findings)
    detected = case.overstretched or evidence.best(laws) > threshold(laws, settings)
    if detected:
        parts = costly(clip, case.base, memo, case.workers)
        findings += searched(case, lambda s, text: progress(0.64, 1, text), parts)
        laws = by_law(findings)
    ranked, refits = sorted(laws, key=lambda term: -laws[term].evidence), []
    if detected:
        case, refits = compete(case, laws, ranked, progress)
        k = single_track(case, refits[0]) if single else None
        if k is not None:
            return without_track(recording, int(clip.kept[k]), refits[0].term, asked, progress, runs, single - 1)
    fitted = None
    if detected:
        refits, fitted = explained_by(case, refits, progress)
    return verdict.write(case, laws, ranked, refits, fitted, lambda text: progress(0.97, 1, text))


def without_track(
    recording: Recording, point: int, term: str, settings: Diagnosing, progress: Progress, memo: Memo, single: int
) -> tuple[Diagnosis, Physics, Mismatch]:
    """The diagnosis without a point's track, which alone asked for a law, and says so."""
    said = f"its track alone asked for {term.replace('_', ' ')}"
    progress(0.01, 1, f"again without point {point}: {said}")
    visible = recording.visible.copy()
    visible[point] = False
    less = replace(recording, visible=visible)
    found, physics, mismatch = diagnose(less, settings, progress, memo.without(point), single)
    noise = found.noise | {"left_out": [point, *found.noise.get("left_out", [])]}
    words = f"{found.words} Point {point} was left out: {said}."
    return replace(found, noise=noise, words=words), physics, mismatch


def compete(case: Case, laws: Scores, ranked: list[str], progress: Progress) -> tuple[Case, list[Refit]]:
    """The best laws as the engine runs them, best first, and the case with what was learned of its grips."""
    settings, refits = case.settings, []
    best = laws[ranked[0]].best.gain
    waiting = [t for t in ranked if laws[t].best.gain > calibration.RIVAL * best][: settings.refine]
    while waiting:
        progress(0.65 + 0.02 * len(refits), 1, f"the engine with {', '.join(waiting)}")
        fine = [sharpened(case, laws[term], case.z) for term in waiting]
        refits += at_once(lambda one, _: refit(case, *one, case.z), fine, case.workers)
        known = {r.term for r in refits}
        top = max(r.log_evidence for r in refits)
        rest = [t for t in ranked if t not in known and laws[t].evidence > top]
        # What the engine does not confirm gives way to what the tangent puts next.
        waiting = rest[:1] if len(refits) < 2 * settings.refine else []
    refits.sort(key=lambda r: -r.log_evidence)
    if from_rest(case, refits[0], case.z):
        case = replace(case, clip=replace(case.clip, shifted=False))
        refits = [refit(case, r.finding, r.searched, case.z) for r in refits]
        refits.sort(key=lambda r: -r.log_evidence)
    progress(0.74, 1, f"other laws where {refits[0].term} acts")
    refits = gathered(case, laws, refits)
    refits += unheard(case, laws, ranked, refits, progress)
    close = [r for r in refits if r.gain > calibration.CLOSE * refits[0].gain]
    close = close[: min(settings.free, int(settings.budget / fit_of_a_law(case)))]
    for n, one in enumerate(close):
        done = 0.75 + 0.1 * n / len(close)
        better = freed(case, one, case.z, lambda text, done=done: progress(done, 1, text))
        refits = [better if r is one else r for r in refits]
    return case, sorted(refits, key=lambda r: -r.log_evidence)


def unheard(case: Case, laws: Scores, ranked: list[str], refits: list[Refit], progress: Progress) -> list[Refit]:
    """All other laws as the engine runs them once, where only the frames held out may tell: where the fitted ones say
    nothing clear of any, or the best of them is refuted. What a law foretells is not known from what it does there.
    None of a video, whose guessed body is off by more than that."""
    if case.prospect is None or judgement.guessed(case):
        return []
    first = refits[0]
    ahead = case.prospect.gain(of_base(case), of_laws(case, [first], case.base.simulated + first.response))
    if first.log_evidence >= calibration.CLEAR and not ahead.refuted:
        return []
    known = {r.term for r in refits}
    others = [t for t in ranked if t not in known and laws[t].best.gain > calibration.SOME]
    if not others:
        return []
    progress(0.745, 1, f"frames held out with {', '.join(others)}")
    fine = [sharpened(case, laws[term], case.z) for term in others]
    return at_once(lambda one, _: refit(case, *one, case.z, rounds=1), fine, case.workers)


def gathered(case: Case, laws: Scores, refits: list[Refit]) -> list[Refit]:
    """Laws, those that act in a blob tried where the best one does too and kept where they say more there; best first.

    What a law does is in proportion to its strength only where it is weak: a lump so stiff that it moves as one shows
    beside where it is, and the lattice's best place of the right law may be farther off than that of another.
    """
    first = refits[0].finding.hypothesis
    if not first.in_blob:
        return refits

    def there(one: Refit, _worker: int) -> Refit:
        blobs = [f for f in laws[one.term].findings if f.hypothesis.in_blob]
        near = min(blobs, key=lambda f: (first.apart(f.hypothesis), -f.gain), default=None)
        if near is None or near is laws[one.term].best:
            return one
        other = refit(case, *sharpened(case, laws[one.term], case.z, near), case.z)
        return max(one, other, key=lambda r: r.log_evidence)

    found = [refits[0], *at_once(there, refits[1:], case.workers)]
    return sorted(found, key=lambda r: -r.log_evidence)


def first_look(
    recording: Recording, settings: Diagnosing, memo: Memo, progress: Progress
) -> tuple[Case, list[Finding]]:
    """Noise, base, nuisances, and all that is cheap to try. Raises Problem where the recording cannot be used."""
    clip = clip_of(recording, share=settings.grid, device=settings.device)
    out = f", without {clip.strayed} samples of other points" if clip.strayed else ""
    progress(0.01, 1, f"noise of {len(clip.kept)} points on {clip.until} frames{out}")
    case = prepare_case(clip, settings, memo, progress)

    def looked(case: Case) -> list[Finding]:
        return searched(case, lambda s, text: progress(0.25 + 0.39 * s, 1, text))

    findings = looked(case)
    mended = laid_anew(case, by_law(findings), progress)
    if mended is not None:
        case, findings = mended, looked(mended)
    if (case.drift > STEADIER * case.drift_at_rest).any():
        progress(0.64, 1, "a camera that drifts as little as it does at rest")
        calm = case.drifting(np.minimum(case.drift, case.drift_at_rest))
        found = looked(calm)
        if evidence.best(by_law(found)) > evidence.best(by_law(findings)):
            case, findings = calm, found
    steadier = steadied(case, by_law(findings), progress)
    if steadier is not None:
        case, findings = steadier, looked(steadier)
    return case, findings


def searched(case: Case, progress: Callable[[float, str], None], parts: Parts | None = None) -> list[Finding]:
    """Every hypothesis of `parts` (or of all that is cheap) against the base's residual."""
    found = search(case, case.z, case.nulls, progress, parts)
    return [replace(f, log_evidence=f.log_evidence - case.behind) for f in found]


def steadied(case: Case, laws: Scores, progress: Progress) -> Case | None:
    """The case with the drift of the camera that is likeliest beside the best law; None where it stays.

    A drift is learned without any law, and what breathes or weighs on tissue moves the whole picture too. So the best
    law and the drift are weighed together.
    """
    best = max(laws, key=lambda term: laws[term].evidence)
    if laws[best].evidence < calibration.TRIED or "drift" in case.settings.without:
        return None
    progress(0.64, 1, f"the camera's drift beside {best}")
    law = refit(case, laws[best].best, laws[best].evidence, case.z)
    if not law.response.any():
        return None
    sizes = case.likeliest_drift(case.whiten(law.response[:, : case.clip.until]))
    return None if np.abs(np.log(sizes / case.drift)).max() < np.log(STEADIER) else case.drifting(sizes)


def laid_anew(case: Case, laws: Scores, progress: Progress) -> Case | None:
    """The case with what is held laid where it seems to end, or surely near its box; None where it seems to end there.

    Near its box is where the engine, or a law that says more, has it end: farther off its effect is not in proportion,
    and would make up for a law. A soft layer at the base makes up for a plane that lies elsewhere.
    """
    space, top, rivals = case.space, max(laws, key=lambda term: laws[term].evidence), []
    if laws[top].evidence > calibration.THRESHOLD:
        law = refit(case, laws[top].best, laws[top].evidence, case.z)
        white = case.whiten(law.response[:, : case.clip.until])
        beside = metric(np.concatenate([space.columns, white[:, None]], 1))
        rivals.append((nuisance.likely_held(case.groups, beside.likely(case.z - white)), 0.0))
        rivals.append((nuisance.likely_held(case.groups, space.likely(case.z)), law.gain))
    else:
        rivals.append((nuisance.likely_held(case.groups, space.likely(case.z)), 0.0))
    off, least = next(((off, least) for off, least in rivals if abs(off) > nuisance.FAR_OFF), (0.0, 0.0))
    if off == 0.0:
        return None
    by = float(np.clip(off, -MOST_HELD, MOST_HELD))
    near = case.open_by("held", nuisance.FAR_OFF / HELD / 2)
    try:
        moved = prepare_case(case.clip.laid(raised=by), case.settings, case.memo, progress, case.base, case.drift)
    except (Problem, Breakdown):
        return near
    return moved if case.misfit - moved.drifting(case.drift).misfit - (by / HELD) ** 2 > least else near


def hazy(case: Case, laws: Scores) -> bool:
    """Whether something is hidden for certain and no law says clearly what.

    What is hidden close to a grip, where tissue tears, is steeper than a coarse grid can show: there nothing fits well,
    and how firmly the grip carries makes up for it.
    """
    return case.overstretched and evidence.best(laws) < calibration.CLEAR


def prepare_case(
    clip: Clip, settings: Diagnosing, memo: Memo, progress: Progress, begun: Base | None = None,
    drift: np.ndarray | None = None, others: list[Group] | None = None,
) -> Case:  # fmt: skip
    """Noise, base, nuisances, with the drift of the camera that is likeliest without any law.

    begun: a base of nearly the same body; drift: how far the camera may drift over the clip beside it [m], (3,), as at
    rest if None; others: `nuisance.other_bodies` beside `begun`, which serve again where the base stays NEAR it. A base
    fitted beside much less than all fitted frames then ask for made up for the camera, and is fitted again.
    """
    until = clip.until
    fitted = slice(0, until)
    noise = estimate(
        clip.moved[:, fitted],
        clip.seen[:, fitted],
        clip.rest,
        clip.quiet()[fitted],
        *clip.nominal,
        untouched=clip.untouched,
    )
    if clip.recording.astray:
        noise = by_frame(noise, clip.moved, clip.seen)
    if settings.noise == "independent":
        noise = replace(
            noise, level=np.full(len(clip.kept), noise.sigma), shared=0.0, rigid=0.0, tilt=0.0, lasting=0.0, white=1.0
        )
    whiten = whitener(noise, clip.rest, clip.seen[:, fitted], settings.offsets, clip.device)
    at_rest = nuisance.drift_of(clip, noise, settings.offsets)
    drift = at_rest if drift is None else drift

    def beside(clip: Clip, simulated: np.ndarray, gradient: np.ndarray, error: np.ndarray) -> np.ndarray:
        return whitened(whiten, nuisance.of_base(clip, simulated, error, gradient, drift, noise, settings), until)

    exact = settings.model_error == 0 or "simulator" in settings.without
    clip, base, fine = fit_base(
        clip, whiten, beside, memo, finer=None if exact else nuisance.FINER * settings.grid,
        workers=workers(clip, settings), timing="release" not in settings.without, begun=begun,
        say=lambda text: progress(0.1, 1, text),
    )  # fmt: skip
    if others is None or (np.abs(base.x - begun.x) > NEAR * clip.prior.spread).any():
        progress(0.2, 1, "other grips, held tissue and elastic laws")
        others = nuisance.other_bodies(clip, base, memo, workers(clip, settings))
    groups = nuisance.of_laws(clip, base, drift, noise, settings, others)
    fixed = whitened(whiten, groups, until)
    space = metric(np.concatenate([fixed, whiten(base.slopes).T], 1))
    slopes = slice(fixed.shape[1], fixed.shape[1] + len(base.slopes))
    clip, base = settled(clip, fine, whiten, space, slopes, base, memo)
    z = whiten(clip.moved[:, fitted] - base.simulated[:, fitted])
    drawn = nulls(space, whiten, settings)
    case = Case(clip, settings, noise, whiten, base, space, memo, z, drawn, slopes, groups, drift, at_rest)
    if "drift" in settings.without:
        return case
    likeliest = case.likeliest_drift()
    if begun is None and (likeliest > MORE * drift).any():
        progress(0.2, 1, f"the base beside a camera that drifts by {1e3 * likeliest.max():.2g} mm")
        return prepare_case(clip.less(None), settings, memo, progress, base, np.maximum(drift, likeliest), others)
    return case.drifting(likeliest)


def whitened(whiten: Whitener, groups: list[Group], until: int) -> np.ndarray:
    """Columns of all groups over the fitted frames, (N, M) float32."""
    parts = [whiten(g.columns[:, :, :until]).T.astype(np.float32) for g in groups]
    return np.concatenate(parts, 1) if parts else np.zeros((3 * whiten.mask.size, 0), np.float32)


def from_rest(case: Case, best: Refit, z: np.ndarray) -> bool:
    """Whether paths of grips count from where tissue was at rest: whether the best law fits clearly better that way."""
    law, until = law_of(best.finding.hypothesis, best.amplitude, case.clip), case.clip.until

    def cost(shifted: bool, _worker: int) -> float:
        moved = respond(replace(case.clip, shifted=shifted), case.base, law, case.memo)
        left = z - case.whiten(moved[:, :until] - case.base.simulated[:, :until])
        return float(case.space.gram(left[:, None], left[:, None])[0, 0])

    try:
        found, rest = at_once(cost, [True, False], case.workers)
    except IMPOSSIBLE:
        return False
    return found - rest > calibration.THRESHOLD


def explained_by(case: Case, refits: list[Refit], progress: Progress) -> tuple[list, Joint]:
    """What may be named: the best law, or two that fit clearly better together; and the laws, the named one first."""
    settings = case.settings
    free = settings.free > 0 and 2 * fit_of_a_law(case) < settings.budget

    def fit(laws: list[Refit]) -> Joint:
        return fit_jointly(case, laws, lambda text: progress(0.93, 1, text), free=free)

    one = fit(refits[:1])
    if not settings.second:
        return refits, one
    pairs: dict[frozenset, list[Refit]] = {}
    firsts = [r for r in refits[:FIRSTS] if r.gain > calibration.CLOSE * refits[0].gain]
    progress(0.86, 1, f"what {' and '.join(r.term for r in firsts)} leave{'s' if len(firsts) == 1 else ''}")
    seconds = at_once(lambda first, _: another(case, first), firsts, case.workers)
    for first, second in zip(firsts, seconds, strict=True):
        if second is not None:
            terms = frozenset((first.term, second.term))
            pairs[terms] = max(pairs.get(terms, []), [first, second], key=promise)
    order = sorted(pairs.values(), key=promise, reverse=True)
    tried = [fit(pair) for pair in order if promise(pair) > calibration.RUNNER_UP * promise(order[0])]
    both = max(tried, key=lambda t: t.gain, default=None)
    if both is None or not judgement.pays(case, one, both):
        return refits, replace(one, beside=both)
    said = needed(case, both)
    # Beside its second, the first is as evident as the two are together.
    first = replace(said.refits[0], log_evidence=refits[0].log_evidence + 0.5 * (said.gain - one.gain))
    return [first, *(r for r in refits if r.term != first.term)], replace(said, beside=one)


def promise(pair: list[Refit]) -> float:
    """What two laws gain one after the other, before they are fitted together."""
    return sum(r.gain for r in pair)


def another(case: Case, first: Refit) -> Refit | None:
    """The second effect that pays most once the first is there; None where none may do."""
    until = case.clip.until
    if judgement.still(case, case.base.simulated + first.response) <= calibration.LITTLE_LEFT:
        return None
    white = case.whiten(first.response[:, :until])
    # The first law's strength is open again: its signature joins the nuisances.
    space = metric(np.concatenate([case.space.columns, white[:, None]], 1))
    left = replace(case, space=space)
    z = case.z - white
    found = search(left, z, case.nulls, lambda *_: None)
    laws = by_law([f for f in found if f.hypothesis.term != first.term])
    best = max(laws, key=lambda term: laws[term].evidence)
    if laws[best].evidence < max(calibration.THRESHOLD, threshold(laws, case.settings)):
        return None
    return refit(left, *sharpened(left, laws[best], z), z)
