"""What points do under laws that remember, followed along every frame of the base run.

A memory is followed once for a form, wherever the law then acts: over time the stresses of a form are few patterns
with a course each, and only those are weighted by a place and answered by the tangent.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from surgisim.diagnosis.base import values_on
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.scopes import Where
from surgisim.diagnosis.tangent import base_piola
from surgisim.physics.catalogue import choose

SMALL = 1e-3
"""Strength at which a law's slope is taken, where its stress is not linear in it."""
STEPS = 2
"""Steps between two frames in which a memory advances."""
STILL = 1e-5
"""Change of F between two frames below which tissue stands still."""
LEFT_OUT = 2e-3
"""Of the stresses' length over all frames, that their patterns leave out [1]."""


@dataclass(frozen=True)
class Strained:
    """The base run, frame by frame."""

    F: np.ndarray
    """(T, P, 3, 3)"""
    stress: np.ndarray
    """First Piola stress of the laws that store energy [Pa], (T, P, 3, 3)."""
    still: np.ndarray
    """Whether nothing moved since the frame before, (T,) bool."""


def strained(look: Look) -> Strained:
    """Of the fitted frames."""

    def make() -> Strained:
        near, base = look.base.tangent, look.base
        F = np.stack([near.gradient(t) for t in range(look.clip.until)])
        still = np.abs(np.diff(F, axis=0, prepend=F[:1])).max((1, 2, 3)) < STILL
        still[0] = False
        stress = np.empty_like(F)
        for t in range(len(F)):
            stress[t] = stress[t - 1] if still[t] else base_piola(base.prepared, values_on(look.clip, base.x), F[t])
        return Strained(F, stress, still)

    return look.once("strained", None, make)


Stress = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""F, (P, 3, 3), memory, (P, M), and the base's first Piola stress -> the law's own [Pa], (P, 3, 3)."""


def followed(
    look: Look, term: str, row: dict, stress: Stress, wheres: Sequence[Where], *, fades: bool = False
) -> np.ndarray:
    """Displacement of the points [m], (Q, K, T, 3), for each of the places.

    row: the law's columns; fades: whether its memory goes on changing where tissue stands still.
    """
    x = look.clip.on_grid(look.base.x).tolist()
    kept = look.memo(["followed", x, term, row], lambda: _patterns(_stresses(look, term, row, stress, fades)))
    patterns, courses = kept["patterns"].astype(float).reshape(-1, len(look.rest), 3, 3), kept["courses"]
    near, weights = look.base.tangent, np.stack([w.weight(look.rest) for w in wheres])
    # One product per state: all patterns at all places.
    loads = np.concatenate([near.of_stress(w[:, None, None] * patterns) for w in weights])
    answers = (near.answer @ loads.T).reshape(len(near.frames), -1, len(wheres), len(patterns))
    share = near.share[:, :, None] * courses[:, None, :]
    found = np.einsum("tsr,skqr->qkt", share, answers, optimize=True)
    return found.reshape(len(wheres), -1, 3, len(courses)).swapaxes(2, 3)


def _stresses(look: Look, term: str, row: dict, stress: Stress, fades: bool) -> np.ndarray:
    """First Piola stress of the law at every frame [Pa], (T, 9 P)."""
    run, law = strained(look), choose([term])[term]
    count = len(look.rest)
    memory, rigid = np.zeros((count, law.memory)), np.zeros((count, 3, 3))
    found = np.zeros((len(run.F), 9 * count))
    for t in range(1, len(run.F)):
        still = run.still[t]
        if still and not fades:
            found[t] = found[t - 1]
            continue
        steps = 1 if still else STEPS
        for s in range(steps):
            F = run.F[t - 1] + (run.F[t] - run.F[t - 1]) * (s + 1) / steps
            memory = law.twin_advance(F, rigid, None, memory, 1 / look.clip.fps / steps, **row)
        found[t] = stress(run.F[t], memory, run.stress[t]).ravel()
    return found


def _patterns(stresses: np.ndarray) -> dict[str, np.ndarray]:
    """The few patterns, (R, 9 P) float32, and their courses, (T, R), whose products are stresses, (T, 9 P)."""
    sizes, courses = np.linalg.eigh(stresses @ stresses.T)
    sizes, courses = np.maximum(sizes[::-1], 0), courses[:, ::-1]
    left = 1 - np.cumsum(sizes) / max(sizes.sum(), 1e-300)
    count = int(np.argmax(left < LEFT_OUT**2)) + 1
    return {"patterns": (courses[:, :count].T @ stresses).astype(np.float32), "courses": courses[:, :count]}
