"""Which residual laws a recording bears: one after the other, each only if its evidence pays for it.

The forms (forms/) are tried at every place and course on the tangent of the base run, beside noise and nuisances, as
named laws are; what is found is run and fitted by the engine, base and all. A further one is sought on what the first
leaves, the first's strength being open again. Only fitted frames are looked at.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from surgisim.diagnosis import calibration, candidates
from surgisim.diagnosis.context import Case
from surgisim.diagnosis.evidence import Finding, Scores, by_law
from surgisim.diagnosis.joint import Joint, fit_jointly, least, needed
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.metric import metric
from surgisim.diagnosis.refit import Refit, fit_of_a_law, freed, refit
from surgisim.diagnosis.search import search, sharpened, threshold

MOST = 2
"""Residual laws at most; chosen."""
RUN = 2
"""Forms that the engine runs for each of them."""

Say = Callable[[str], None]


def fit(case: Case, say: Say) -> Joint | None:
    """The residual laws that pay, fitted together by the engine; None where none does."""
    first = _next(case, case.z, (), say)
    if first is None:
        return None
    free = case.settings.free > 0 and fit_of_a_law(case) < case.settings.budget
    if free:
        first = freed(case, first, case.z, say)
    best = fit_jointly(case, [first], say, free=False)
    while len(best.refits) < MOST:
        more = _beside(case, best, free, say)
        if more is None:
            break
        best = more
    return best


def _beside(case: Case, one: Joint, free: bool, say: Say) -> Joint | None:
    """With one more law; None where none pays beside those that are there."""
    until = case.clip.until
    white = case.whiten(one.moved[:, :until] - case.base.simulated[:, :until])
    # The strength of what was found is open again: its signature joins the nuisances.
    left = replace(case, space=metric(np.concatenate([case.space.columns, white[:, None]], 1)))
    second = _next(left, case.z - white, tuple(r.term for r in one.refits), say)
    if second is None:
        return None
    both = fit_jointly(case, [*one.refits, second], say, free=free and 2 * fit_of_a_law(case) < case.settings.budget)
    both = needed(case, both)
    return both if len(both.refits) > len(one.refits) and 0.5 * (both.gain - one.gain) > least(one) else None


def _next(case: Case, z: np.ndarray, taken: tuple[str, ...], say: Say) -> Refit | None:
    """The form that says most of a whitened residual, as the engine runs it; None where none says enough."""
    found = findings(case, z, taken, say)
    laws = by_law(found)
    ranked = sorted(laws, key=lambda term: -laws[term].evidence)[:RUN]
    if not pays(laws, case):
        return None
    say(f"the engine with {', '.join(ranked)}")
    run = [refit(case, *sharpened(case, laws[term], z), z) for term in ranked]
    best = max(run, key=lambda r: r.log_evidence)
    return best if best.response.any() and best.log_evidence > calibration.THRESHOLD else None


def findings(case: Case, z: np.ndarray, taken: tuple[str, ...], say: Say) -> list[Finding]:
    """Every form, but for those taken, at every place and course."""
    look = Look(case.clip, case.base, case.memo)
    parts = candidates.without_a_name(look, taken)
    found = search(case, z, case.nulls, lambda _share, text: say(f"a law without a name: {text}"), parts)
    return [replace(f, log_evidence=f.log_evidence - case.behind) for f in found]


def pays(laws: Scores, case: Case) -> bool:
    """Whether the best form's evidence, less what having several of them to choose from costs, is enough."""
    most = max(score.evidence for score in laws.values()) - float(np.log(len(laws)))
    return most > max(calibration.THRESHOLD, threshold(laws, case.settings))
