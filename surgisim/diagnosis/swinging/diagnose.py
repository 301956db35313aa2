"""What the simulation of a swinging or hanging body lacks: the law under which what was held out is foretold best.

Nothing is linearised. Every law is run by the engine, its numbers scanned and then fitted together with the base's to
all recordings that are fitted; held out is another recording of the body, or the last frames, or every second point
where it is seen at rest alone. A law is named where it takes more off the error there than chance would, all laws that
were tried together. One within CLOSE of the best there cannot be told from it. Probabilities only say how
far the others are behind; they are not calibrated.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import ttest_1samp

from surgisim.artifacts.diagnosis import Diagnosis
from surgisim.artifacts.mismatch import Mismatch
from surgisim.artifacts.physics import Physics
from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis.base import SAFETY, TERMS
from surgisim.diagnosis.clip import Clip, clip_of
from surgisim.diagnosis.memo import NOTHING_KEPT, Memo
from surgisim.diagnosis.prior import Prior, prior_of
from surgisim.diagnosis.swinging import course as courses
from surgisim.diagnosis.swinging.candidates import laws
from surgisim.diagnosis.swinging.course import Course, simulate
from surgisim.diagnosis.swinging.fit import Body, Numbers, Tried, fit_base, try_base, try_law, units
from surgisim.diagnosis.swinging.law import Frame, Law, frame_of
from surgisim.diagnosis.swinging.period import Responses, responses, slowest_period
from surgisim.estimation.identify import NINETY
from surgisim.physics.catalogue import choose
from surgisim.problem import Problem
from surgisim.recordings.recording import Recording

CLOSE = 1.10
"""Times the best law's error in what is held out below which another law does as well; chosen."""
SUREST = 0.03
"""Least spread of a logarithm that another recording of the same body, form and all, told; chosen: five per cent either
way at 90 %, as much as two grids of a beam differ."""
DOUBT = 0.05
"""Chance, over all laws together, at which one may foretell better than the base by accident and be named."""
LEAST_SWINGS = 6
"""Swings held out below which points are compared instead; chosen."""
Progress = Callable[[float, float, str], None]


@dataclass(frozen=True)
class HeldOut:
    course: Course
    words: str


def diagnose_swinging(
    recordings: Sequence[Recording],
    held_out: Recording | None,
    settings: Diagnosing,
    progress: Progress,
    memo: Memo = NOTHING_KEPT,
) -> tuple[Diagnosis, Physics, Mismatch]:
    """Of one body, recorded once or several times. Raises Problem where nothing holds it, or where bodies differ."""
    clips = [clip_of(r, share=settings.grid, device=settings.device) for r in recordings]
    same_body(clips[0], [*clips[1:], *([] if held_out is None else [clip_of(held_out, share=settings.grid)])])
    first = clips[0]
    if not first.body.held.any():
        raise Problem(f"recording {first.recording.name}: nothing holds the body. Say in fixed.json what does.")
    prior = prior_of(first.recording, SUREST)
    given = prior if first.recording.expected else None
    elastic, settles = settings.base == "elastic", all(courses.comes_to_rest(c) for c in clips)
    rough = tuple(courses.fitted(c, np.inf if settles else courses.seen_period(c)) for c in clips)
    body, held = _held_out(Body(rough, elastic, settles, memo), held_out, settings)
    say = lambda text: progress(0.02, 1, text)  # noqa: E731
    numbers = fit_base(body, lambda x: slowest_period(first, x), given, say)
    x = numbers.x
    told = responses(first, x)
    if not settles:
        swung = (replace(c, weight=courses.alike(c.clip, told.period), period=told.period) for c in body.courses)
        body = replace(body, courses=tuple(swung))
        held = replace(held, course=replace(held.course, period=told.period))
    base = try_base(body, x, held.course, told.period)
    # Without the law its numbers went as far as they may to make up for it.
    start = x if given is None else given.middle
    frame = frame_of(first, start, told.period)
    tried, every = [], laws(frame, elastic, settles)
    for n, law in enumerate(every):
        progress(0.15 + 0.8 * n / len(every), 1, f"trying {law.term.replace('_', ' ')} ({n + 1} of {len(every)})")
        found = try_law(law, body, start, given, held.course, frame)
        tried += [] if found is None else [found]
    tried, also = best_of_each(tried), []
    if settles and held_out is None and tried:
        # Few points are held out: those that were fitted are foretold by the others, too.
        progress(0.95, 1, f"{tried[0].law.term.replace('_', ' ')} the other way round")
        also = [_swapped(body, held.course, tried[0].law, numbers, given, frame)]
    progress(0.97, 1, "verdict")
    return written(body, replace(base, spread=numbers.spread), tried, held, told, also)


def same_body(first: Clip, others: Sequence[Clip]) -> None:
    """Raises Problem where recordings are not of one body in one frame of reference."""
    for other in others:
        mine, theirs = first.recording, other.recording
        apart = mine.mesh.vertices.shape != theirs.mesh.vertices.shape or not np.allclose(
            mine.mesh.vertices, theirs.mesh.vertices, atol=1e-6
        )
        boxes = mine.boxes.shape != theirs.boxes.shape or not np.allclose(mine.boxes, theirs.boxes, atol=1e-6)
        if apart or boxes or mine.starts != theirs.starts or mine.density != theirs.density:
            what = "rest.ply" if apart else "fixed.json" if boxes else "recording.json (starts, density_kg_m3)"
            raise Problem(
                f"recordings {mine.name} and {theirs.name}: their {what} differ, but one body at rest in one frame of "
                "reference is wanted. Give recordings of the same body."
            )


def _held_out(body: Body, recording: Recording | None, settings: Diagnosing) -> tuple[Body, HeldOut]:
    if recording is not None:
        clip = clip_of(recording, share=settings.grid, device=settings.device)
        course = courses.whole(clip).first(max(c.until for c in body.courses))
        return body, HeldOut(course, f"recording {recording.name}, which was never fitted")
    own = body.courses[0]
    if len(body.courses) > 1:
        raise Problem("several recordings are fitted, and none is held out. Say which one with --hold-out.")
    frames = courses.kept_out(own.clip)
    if frames.frames.any():
        return body, HeldOut(frames, "the frames held out")
    half, rest = courses.every_second(own)
    return replace(body, courses=(half, *body.courses[1:])), HeldOut(rest, "points between those that were fitted")


def _swapped(
    body: Body, held: Course, law: Law, numbers: Numbers, given: Prior | None, frame: Frame
) -> tuple[Body, Tried, Tried | None, Course]:
    """Base and law fitted to what was held out, and what they then foretell."""
    other, (own, *_) = replace(body, courses=(held, *body.courses[1:])), body.courses
    x = fit_base(other, lambda x: slowest_period(body.clip, x), given, lambda text: None).x
    found = try_law(law, other, numbers.x if given is None else given.middle, given, own, frame)
    return other, try_base(other, x, own, frame.period), found, own


def written(
    body: Body, base: Tried, tried: list[Tried], held: HeldOut, told: Responses, also: Sequence[tuple] = ()
) -> tuple[Diagnosis, Physics, Mismatch]:
    """Verdict, laws, and where it was off. tried: each law once, the best first; also: as `_swapped` gives it."""
    best = tried[0] if tried else None
    pays = best is not None and best.fitted < base.fitted
    pays = pays and surely_better([(body, base, best, held.course), *also], len(tried))
    like = [t for t in tried[1:] if pays and t.other < CLOSE * best.other and t.fitted < base.fitted]
    verdict = "nothing detectable" if not pays else "equivalence class" if like else "named"
    share = shares(tried, body, told)
    clip, named = body.clip, [best, *like] if pays else []
    runs = {"before": base} | ({"after": best} if pays else {})
    seen = courses.whole(clip)
    moved = {k: seen.let_go(simulate(clip, t.values, t.places, clip.frames)) for k, t in runs.items()}
    errors = {"unit": "mm", "noise_floor": None, "flexible": None}
    worst = tried[-1] if pays else None
    diagnosis = Diagnosis(
        recording=clip.recording.name,
        verdict=verdict,
        effects=[_effect(t, share, tried, named) for t in named],
        ranking=[_row(t, share) for t in tried],
        detectable_above={},
        missing_phases=[],
        fit=errors | _errors(base.fitted, best.fitted if pays else None, worst and worst.fitted),
        held_out=errors | _errors(base.other, best.other if pays else None, worst and worst.other),
        unexplained_fraction=float(min(1.0, (best.other / base.other) ** 2)) if pays else 0.0,
        words=words(base, tried, like, pays, held, body),
        base=base_numbers(base, body),
        noise={"sigma": float(np.median(clip.nominal[0])), "unit": "m"},
        global_test={"responses": told.told(), "calibrated": False, "held_out": held.words},
    )  # fmt: skip
    left = {k: _left(clip, m) for k, m in moved.items()}
    scale = max(base.fitted, 1e-9)
    particles = clip.body.rest.astype(float)
    place = next(iter(best.places.values()), None) if pays else None
    cause = np.zeros(len(particles)) if place is None else place.weight(particles)
    mismatch = Mismatch(
        points=clip.rest, residual_before=left["before"], residual_after=left.get("after", left["before"]),
        z=np.linalg.norm(left["before"], axis=-1) / scale, significant=1.0, particles=particles, cause=cause,
        cause_time=np.zeros(clip.frames), phase=clip.phases(),
    )  # fmt: skip
    return diagnosis, physics(body, base, best if pays else base), mismatch


def surely_better(foretold: Sequence[tuple[Body, Tried, Tried | None, Course]], tried: int) -> bool:
    """Whether a law foretells what was held out better than the base, for certain beside `tried` laws.

    A one-sided t test of what the law takes off the squares in each swing, since errors last about that long; where
    fewer than LEAST_SWINGS were held out, at each point. Bonferroni's correction over all laws.

    foretold: base, law and what was held out of each fit, at least one; a law that broke down there is none.
    """
    parts = []
    for body, base, law, held in foretold:
        if law is None:
            return False
        before, after = (held.squares(body.moved(held, t.values, t.places)) for t in (base, law))
        off = before - after
        swing = held.period * held.clip.fps
        swings = int(held.frames[: held.until].sum() / swing) if np.isfinite(swing) else 0
        if swings >= LEAST_SWINGS:
            parts += [part.sum() for part in np.array_split(off.sum(0)[held.frames[: held.until]], swings)]
        else:
            parts += list(off.sum(1)[held.seen.any(1)])
    if np.ptp(parts) == 0:
        return bool(parts[0] > 0)
    return bool(ttest_1samp(parts, 0.0, alternative="greater").pvalue < DOUBT / max(tried, 1))


def best_of_each(tried: list[Tried]) -> list[Tried]:
    """Of each law its best form, best first by what is held out."""
    found: dict[str, Tried] = {}
    for one in sorted(tried, key=lambda t: t.other):
        found.setdefault(one.law.term, one)
    return list(found.values())


def shares(tried: list[Tried], body: Body, told: Responses) -> dict[str, float]:
    """How far laws are behind the best, as shares of one: two independent numbers a swing, not calibrated."""
    if not tried:
        return {}
    frames = max(c.until for c in body.courses)
    weight = {t.law.term: (tried[0].other / t.other) ** frames**0.5 for t in tried}
    total = sum(weight.values())
    return {n: float(w / total) for n, w in weight.items()}


def words(base: Tried, tried: list[Tried], like: list[Tried], pays: bool, held: HeldOut, body: Body) -> str:
    """For a reader."""
    kind = "elastic " if body.elastic else ""
    if not pays:
        return (
            f"The {kind}base is {1e3 * base.other:.2g} mm off {held.words}, and no law that was tried foretells it "
            "better for certain."
        )
    best = tried[0]
    text = (
        f"Without {best.called} the {kind}simulation is {1e3 * base.other:.2g} mm off {held.words}, with it "
        f"{1e3 * best.other:.2g} mm."
    )
    if like:
        also = " or ".join(t.called for t in like)
        text += f" It may be {also} instead: this recording does not tell them apart."
    behind = [t for t in tried[1:] if t not in like]
    if behind:
        text += f" The next law, {behind[0].called}, leaves {1e3 * behind[0].other:.2g} mm."
    return text


def base_numbers(tried: Tried, body: Body) -> dict[str, dict]:
    """E, nu and eta of the base with 90 % intervals; nu was not fitted."""
    stiff, slow = (NINETY * tried.spread[k] for k in (0, 2))
    lag = float(np.exp(tried.x[2]))
    E, nu, eta = float(np.exp(tried.x[0])), float(tried.x[1]), float(np.exp(tried.x[0] + tried.x[2]))
    found = {"E": {"value": E, "low": E * math.exp(-stiff), "high": E * math.exp(stiff), "unit": "Pa"}}
    found["nu"] = {"value": nu, "unit": "1"}
    if not (body.elastic or body.settles):
        both = math.hypot(stiff, slow)
        found["eta"] = {"value": eta, "low": eta * math.exp(-both), "high": eta * math.exp(both), "unit": "Pa s"}
        ends = {"low": lag * math.exp(-slow), "high": lag * math.exp(slow)}
        found["eta / E"] = {"value": lag, **ends, "unit": "s"}
    return found


def physics(body: Body, base: Tried, tried: Tried) -> Physics:
    """The laws and numbers of a fit, on the grid where they hold. What only settles a body is no part of them."""
    clip = body.clip
    values = {n: v for n, v in tried.values.items() if n != "drag" or (tried.law and tried.law.term == "drag")}
    prepared = clip.prepared(tuple(values))
    theta = prepared.theta(values, tried.places)
    step = 1 / clip.fps / prepared.per_frame_of(prepared.stiffest(theta), clip.fps, SAFETY)
    terms = choose(values)
    known = {} if tried.law is None else {tried.law.term: units(tried)}
    told, alone = base_numbers(base, body), tried.law is None
    if alone:
        # Beside a law the base's numbers were fitted again, and how surely is not known apart from the law's.
        known[TERMS[0]] = {n: told[n] for n in ("E", "nu")}
        known |= {TERMS[1]: {"eta": told["eta"]}} if "eta" in told else {}
    return Physics(
        terms={
            n: known.get(n) or {k: {"value": float(v), "unit": terms[n].params[k].unit} for k, v in own.items()}
            for n, own in values.items()
        },
        ratios={"eta / E": told["eta / E"]} if alone and "eta / E" in told else {},
        alone={} if alone else told,
        density=float(clip.density),
        gravity=[float(g) for g in clip.recording.gravity or (0.0, 0.0, 0.0)],
        grid={"spacing": float(clip.body.spacing), "step": float(step)},
        places={
            n: {
                "center": [float(c) for c in p.center],
                "extent": float(p.extent),
                "normal": None if p.normal is None else [float(c) for c in p.normal],
            }
            for n, p in tried.places.items()
        },
    )


def _left(clip: Clip, moved: np.ndarray) -> np.ndarray:
    return np.where(clip.seen[..., None], clip.moved - moved, np.nan)


def _errors(before: float, after: float | None, placebo: float | None) -> dict[str, float | None]:
    found = {"before": before, "after": after, "placebo": placebo}
    return {k: None if v is None else float(1e3 * v) for k, v in found.items()}


def _effect(t: Tried, share: dict[str, float], tried: list[Tried], named: list[Tried]) -> dict[str, Any]:
    place = t.places.get(t.law.term)
    others = [o.law.term for o in tried if o not in named]
    return {
        "term": t.law.term,
        "probability": share[t.law.term],
        "place": "everywhere"
        if place is None
        else {"center": [float(c) for c in place.center], "extent": float(place.extent), "unit": "m"},
        "time": {"onset": None, "end": None},
        "parameters": units(t),
        "runners_up": [{"term": n, "probability": share[n]} for n in others[:4]],
        "separating_experiment": "",
    }


def _row(t: Tried, share: dict[str, float]) -> dict[str, Any]:
    place = t.places.get(t.law.term)
    return {
        "term": t.law.term,
        "place": "everywhere"
        if place is None
        else {"center": [float(c) for c in place.center], "extent": float(place.extent), "unit": "m"},
        "log_evidence": None,
        "probability": share[t.law.term],
        "cos": None,
        "held_out_rms": float(1e3 * t.other),
        "fitted_rms": float(1e3 * t.fitted),
        "numbers": t.numbers.tolist(),
    }
