"""How much better a law explains what is left than nothing does.

For a hypothesis with signatures S (N, H), residual r and the metric of noise and nuisances, and amplitudes drawn from
N(0, L) beforehand,

    log B = 1/2 b^T (G + L^-1)^-1 b - 1/2 log det(1 + L^1/2 G L^1/2),   G = <S, S>, b = <S, r>

and, where an amplitude must be positive, plus log of the share of its posterior above zero over the prior's half. L
gives every signature the RMS sizes of SIZES, equally likely. A law's evidence is the mean, over the scopes in which it
was tried (everywhere, in a blob, in a layer), of the mean of B over the places, times and forms of that scope: a law
that may be anywhere and anything pays for it, and the many places of a blob do not dilute what acts everywhere.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr, logsumexp

from surgisim.diagnosis.form import Block
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.metric import Metric

SIZES = (1.5e-4, 4e-4, 1e-3)
"""RMS length of what an effect does to the points, beforehand [m]."""
ROUNDED = 0.01
"""Chi square below zero beyond which products of signatures, never negative, lost too much to rounding [1]."""


@dataclass(frozen=True)
class Finding:
    hypothesis: Hypothesis
    log_evidence: float
    amplitude: np.ndarray
    """Most likely, (H,)."""
    spread: np.ndarray
    gain: float
    """Of twice the log likelihood: the part of the misfit's chi square that it takes away."""
    nulls: np.ndarray
    """log evidence on residuals of nothing, (D,)."""
    source: int
    """Number of its block."""
    size: float
    """RMS of its signature at the most likely amplitude [m]."""


def judge(block: Block, whiten, space: Metric, cleared: np.ndarray, source: int, seen: np.ndarray) -> list[Finding]:
    """Every hypothesis of a block against residuals that `space` cleared, (N, 1 + D): the recording's, then nulls."""
    mask = seen[None, :, :, None]
    plain = np.einsum("ckti,dkti->cd", block.columns * mask, block.columns, optimize=True) / seen.sum()
    # Whitening is done in single precision, which what stiffens exponentially leaves where tissue is stretched far.
    size = np.sqrt(np.maximum(np.diag(plain), 1e-60))
    white = whiten((block.columns / size[:, None, None, None]).astype(np.float32)).T
    gram = space.gram(white, white)
    if SIZES[-1] ** 2 * np.linalg.eigvalsh(gram)[0] < -ROUNDED:
        gram = space.exact_gram(white)
    gram = gram * size[:, None] * size
    shadow = (white.T @ cleared).astype(float) * size[:, None]
    return [weigh(h, gram, shadow, plain, source) for h in block.hypotheses]


def weigh(h: Hypothesis, gram: np.ndarray, shadow: np.ndarray, plain: np.ndarray, source: int) -> Finding:
    G, b = h.mix.T @ gram @ h.mix, h.mix.T @ shadow
    size = h.mix.T @ plain @ h.mix
    rms = np.sqrt(np.maximum(np.diag(size), 1e-30))
    parts, best = [], None
    for wanted in SIZES:
        L = wanted / rms / np.sqrt(len(rms))
        A = np.eye(len(L)) + L[:, None] * G * L[None]
        y = L[:, None] * b
        x = np.linalg.solve(A, y)
        logs = 0.5 * (y * x).sum(0) - 0.5 * np.linalg.slogdet(A)[1]
        sd = np.sqrt(np.diag(np.linalg.inv(A)))
        if h.sign and len(L) == 1:
            logs = logs + log_ndtr(x[0] / sd[0]) + np.log(2)
        parts.append(logs)
        if best is None or logs[0] > best[0]:
            amplitude = L * x[:, 0]
            if h.sign and len(L) == 1:
                amplitude = np.maximum(amplitude, 0)
            best = (logs[0], amplitude, L * sd)
    logs = logsumexp(parts, axis=0) - np.log(len(SIZES))
    a = best[1]
    gain = float(2 * a @ b[:, 0] - a @ G @ a)
    return Finding(h, float(logs[0]), a, best[2], gain, logs[1:], source, float(np.sqrt(max(a @ size @ a, 0))))


@dataclass(frozen=True)
class Score:
    """What the search says of one law."""

    evidence: float
    """log evidence: mean over scopes of means over what was tried."""
    nulls: np.ndarray
    """The same on residuals of nothing, (D,)."""
    findings: list[Finding]
    """Best first."""

    @property
    def best(self) -> Finding:
        return self.findings[0]


Scores = dict[str, Score]
"""Law -> its score."""


def by_law(findings: list[Finding]) -> Scores:
    """Of everything that was tried."""
    laws: dict[str, list[Finding]] = {}
    for f in findings:
        laws.setdefault(f.hypothesis.term, []).append(f)
    result = {}
    for term, mine in laws.items():
        scopes: dict[str, list[Finding]] = {}
        for f in mine:
            scopes.setdefault(f.hypothesis.scope, []).append(f)
        logs = _mean([_mean([f.log_evidence for f in some]) for some in scopes.values()])
        nulls = _mean([_mean([f.nulls for f in some]) for some in scopes.values()])
        result[term] = Score(float(logs), nulls, sorted(mine, key=lambda f: -f.log_evidence))
    return result


def best(laws: Scores) -> float:
    """log evidence of the best law."""
    return max(score.evidence for score in laws.values())


def highest(laws: Scores) -> np.ndarray:
    """log evidence of the best law on each residual of nothing, (D,)."""
    return np.max([score.nulls for score in laws.values()], 0)


def _mean(logs: list) -> np.ndarray:
    """log of the mean of exp, over the first axis."""
    return logsumexp(logs, axis=0) - np.log(len(logs))
