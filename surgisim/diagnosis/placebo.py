"""What is named, but for its active part: the same body with the law elsewhere, or with a wrong law."""

from dataclasses import replace

import numpy as np

from surgisim.diagnosis.evidence import Finding
from surgisim.diagnosis.joint import Joint, based, prediction
from surgisim.diagnosis.laws import IMPOSSIBLE
from surgisim.diagnosis.metric import metric
from surgisim.diagnosis.refit import Refit, refit

AWAY = 0.012
"""From where a law was found, that the same law is at a wrong place [m]."""
TRIED = 3
"""Wrong laws at most, where the engine breaks down with one."""
LIKE = 2
"""Best laws that are no placebos: the second may stand for the first."""


def placebo(case, named: Joint, refits: list[Refit], laws: dict) -> Joint | None:
    """Of a `diagnose.Case`: the wrong law that fits best, its strength fitted in the engine. None where none acts.

    It acts in the base that was fitted with what is named. With a base of its own, one that does nothing in held-out
    frames would differ there by the bases alone, and be better by chance.
    """
    try:
        same = held(case, named.x)
    except IMPOSSIBLE:
        return None
    # One whose strength came out as nothing is no placebo.
    acting = sorted((f for f in wrong(named, refits, laws) if f.size > 0), key=lambda f: -f.log_evidence)
    for finding in acting[:TRIED]:
        tried = refit(same, finding, finding.log_evidence, same.z)
        if tried.response.any():
            return prediction(case, [tried], same.base.simulated + tried.response, named.x)
    return None


def wrong(named: Joint, refits: list[Refit], laws: dict) -> list[Finding]:
    """The best law at other places where it has one, otherwise laws of as few numbers that nobody would name."""
    best = refits[0].finding.hypothesis
    if best.place is not None:
        places = [f for f in laws[best.term].findings if f.hypothesis.scope == best.scope]
        away = [np.linalg.norm(np.subtract(f.hypothesis.place.center, best.place.center)) for f in places]
        far = [f for f, distance in zip(places, away, strict=True) if distance > AWAY]
        if far:
            return far
    like = {r.term for r in [*named.refits, *refits[:LIKE]]}
    return [
        laws[term].best for term in sorted(laws) if term not in like and laws[term].best.hypothesis.mix.shape[1] <= 3
    ]


def held(case, x: np.ndarray):
    """The case with the base's numbers held at x, (3 + R,). Raises what IMPOSSIBLE names."""
    base, until = based(case, x), case.clip.until
    z = case.z - case.whiten(base.simulated[:, :until] - case.base.simulated[:, :until])
    return replace(case, base=base, z=z, space=metric(np.delete(case.space.columns, case.slopes, axis=1)))
