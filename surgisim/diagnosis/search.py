"""Every hypothesis against a residual, the best of them on finer lattices, and what it must exceed to be run."""

import numpy as np

from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis import calibration
from surgisim.diagnosis.candidates import Parts, blocks, finer
from surgisim.diagnosis.context import Case
from surgisim.diagnosis.evidence import Finding, Score, Scores, highest, judge
from surgisim.diagnosis.locate import worst


def search(case: Case, z: np.ndarray, nulls: np.ndarray, progress, parts: Parts | None = None) -> list[Finding]:
    """Every hypothesis of `parts` (or of all that is cheap) against a whitened residual."""
    left = case.sight.of(np.concatenate([z[:, None].astype(np.float32), nulls], 1))
    only = worst(case.clip, case.base.simulated, case.noise) if case.settings.cause == "symptom" else None
    parts, found, source = list(parts or blocks(case.clip, case.base, case.memo, only)), [], 0
    for n, (name, make) in enumerate(parts):
        progress(n / len(parts), f"trying {name} ({n + 1} of {len(parts)})")
        for block in make():
            found += judge(block, case.sight, left, source)
            source += 1
    return found


def sharpened(case: Case, law: Score, z: np.ndarray, start: Finding | None = None) -> tuple[Finding, float]:
    """A law's best finding, or the best near `start`, on two finer lattices, and the law's evidence there."""
    best = start or law.best
    left = case.sight.of(z[:, None])
    for step in (1.0, 0.5):
        for block in finer(case.clip, case.base, best.hypothesis, step):
            found = judge(block, case.sight, left, -1)
            best = max([best, *(f for f in found if f.hypothesis.term == best.hypothesis.term)], key=lambda f: f.gain)
    return best, law.evidence + 0.5 * (best.gain - law.best.gain)


def threshold(laws: Scores, settings: Diagnosing) -> float:
    """log evidence of the fitted frames that the best law must exceed to be run."""
    if not settings.calibrated:
        return 0.0
    return max(calibration.TRIED, float(np.quantile(highest(laws), 0.95)))
