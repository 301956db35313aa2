"""Whether the evidence that nothing but noise and nuisances reaches is what a diagnosis says it is.

Recordings drawn from the diagnosis' own model of a recording conceal nothing; diagnosed again, the evidence of their
best law should lie among their stated nulls as one more of them.
"""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.stats import ks_1samp, ks_2samp, uniform

from surgisim.diagnosis.diagnose import Case
from surgisim.problem import Problem
from surgisim.proof.shares import share
from surgisim.recordings.recording import Recording

FORMAT = "surgisim-self-consistency/1"
Drawn = Callable[[Case, np.random.Generator], np.ndarray]
"""Displacement of a case's points [m], (K, T, 3), as its model of noise and nuisances has it."""
LEVELS = (0.5, 0.2, 0.1, 0.05)
"""Shares of nulls beyond which evidence is counted [1]."""


def noise_alone(case: Case, rng: np.random.Generator) -> np.ndarray:
    """The base's motion with noise, without nuisances: what is drawn where the diagnosis has no draws of its own."""
    return case.base.simulated + case.noise.draw(case.clip.rest, case.clip.frames, rng)


def draws_of_the_diagnosis() -> Drawn:
    """`drawn` of surgisim.diagnosis.self_consistency where there is such a file, else noise alone."""
    try:
        from surgisim.diagnosis.self_consistency import drawn
    except ModuleNotFoundError:
        return noise_alone
    return drawn


def draws(case: Case, count: int, seed: int, drawn: Drawn) -> np.ndarray:
    """Displacements of that many drawn recordings [m], (N, K, T, 3) float32."""
    made = [drawn(case, np.random.default_rng([seed, n])) for n in range(count)]
    wanted = (len(case.clip.rest), case.clip.frames, 3)
    if any(one.shape != wanted or not np.isfinite(one).all() for one in made):
        raise Problem(f"self-consistency: draws of finite displacements {wanted} are wanted. Mend `drawn`.")
    return np.array(made, np.float32)


def recorded(recording: Recording, kept: np.ndarray, rest: np.ndarray, moved: np.ndarray, number: int) -> Recording:
    """The recording with the points `kept` alone, (K,), moved from `rest` [m], (K, 3), as drawn [m], (K, T, 3)."""
    some = recording.of(kept)
    points = np.where(some.visible[..., None], rest[:, None] + moved, np.nan)
    return dataclasses.replace(some, name=f"{recording.name}-{number}", points=points.astype(np.float32))


def consistency(diagnoses: list[dict[str, Any]], seed: int = 0) -> dict[str, Any]:
    """Evidence of drawn recordings against the nulls that each diagnosis states.

    place: where each evidence lies among its nulls, 0 below all to 1 above, ties and gaps at random, so that it is
    uniform where evidence is one more null; ks: Kolmogorov's and Smirnov's test of that, and of all evidence against
    all nulls; beyond: share of evidence above so high a quantile of its nulls, which should be that level.
    """
    rng = np.random.default_rng(seed)
    evidence = np.array([d["global_test"]["log_evidence"] for d in diagnoses], float)
    nulls = [np.array(d["global_test"]["nulls"], float) for d in diagnoses]
    place = np.array([_place(e, n, rng) for e, n in zip(evidence, nulls, strict=True)])
    uniformly, alike = ks_1samp(place, uniform.cdf), ks_2samp(evidence, np.concatenate(nulls))
    return {
        "format": FORMAT,
        "count": len(diagnoses),
        "evidence": evidence.tolist(),
        "nulls": [n.tolist() for n in nulls],
        "place": place.tolist(),
        "ks": {"statistic": float(uniformly.statistic), "p": float(uniformly.pvalue)},
        "ks_pooled": {"statistic": float(alike.statistic), "p": float(alike.pvalue)},
        "beyond": {str(level): share(place > 1 - level).told() for level in LEVELS},
        "named": share(d["verdict"] in ("named", "equivalence class") for d in diagnoses).told(),
        "alarm": share(d["verdict"] != "nothing detectable" for d in diagnoses).told(),
    }


def _place(evidence: float, nulls: np.ndarray, rng: np.random.Generator) -> float:
    below = (nulls < evidence).sum() + rng.integers((nulls == evidence).sum() + 1)
    return float((below + rng.uniform()) / (len(nulls) + 1))
