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
from surgisim.diagnosis.sight import Left, Products, Sight

SIZES = (1.5e-4, 4e-4, 1e-3)
"""RMS length of what an effect does to the points, beforehand [m]."""


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


def judge(block: Block, sight: Sight, left: Left, source: int) -> list[Finding]:
    """Every hypothesis of a block against residuals: the recording's, then nulls."""
    products, found = sight.products(block.columns, left), {}
    alike: dict[tuple, list[int]] = {}
    for n, h in enumerate(block.hypotheses):
        alike.setdefault((h.mix.shape[1], bool(h.sign)), []).append(n)
    for mine in alike.values():
        found |= zip(mine, weigh([block.hypotheses[n] for n in mine], products, source), strict=True)
    return [found[n] for n in range(len(found))]


def weigh(alike: list[Hypothesis], products: Products, source: int) -> list[Finding]:
    """Hypotheses of as many amplitudes, H, and the same freedom of sign, with their block's products."""
    mix = np.stack([h.mix for h in alike])
    back = mix.swapaxes(1, 2)
    G, b, size = back @ products.gram @ mix, back @ products.shadow, back @ products.plain @ mix
    rms = np.sqrt(np.maximum(np.diagonal(size, axis1=1, axis2=2), 1e-30))
    count = mix.shape[2]
    one_sided = count == 1 and bool(alike[0].sign)
    logs, amplitudes, spreads = [], [], []
    for wanted in SIZES:
        L = wanted / rms / np.sqrt(count)
        A = np.eye(count) + L[:, :, None] * G * L[:, None]
        y = L[:, :, None] * b
        x = np.linalg.solve(A, y)
        log = 0.5 * (y * x).sum(1) - 0.5 * np.linalg.slogdet(A)[1][:, None]
        sd = np.sqrt(np.diagonal(np.linalg.inv(A), axis1=1, axis2=2))
        amplitude = L * x[:, :, 0]
        if one_sided:
            log = log + log_ndtr(x[:, 0] / sd) + np.log(2)
            amplitude = np.maximum(amplitude, 0)
        logs.append(log)
        amplitudes.append(amplitude)
        spreads.append(L * sd)
    which, each = np.argmax([log[:, 0] for log in logs], axis=0), np.arange(len(alike))
    a, spread = np.stack(amplitudes)[which, each], np.stack(spreads)[which, each]
    log = logsumexp(logs, axis=0) - np.log(len(SIZES))
    gain = 2 * (a * b[:, :, 0]).sum(1) - np.einsum("nh,nhk,nk->n", a, G, a)
    moved = np.sqrt(np.maximum(np.einsum("nh,nhk,nk->n", a, size, a), 0))
    return [
        Finding(h, float(log[n, 0]), a[n], spread[n], float(gain[n]), log[n, 1:], source, float(moved[n]))
        for n, h in enumerate(alike)
    ]


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
