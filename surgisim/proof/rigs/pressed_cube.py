"""A cube of tissue pressed between two plates: one material point with the engine's laws, free at its sides.

    F = diag(stretch along the load, what the sides do),   sigma_side(F) = 0                    [Pa]

What a testing machine measures is a force, which no camera sees; this is the one place where laws are held against it.
Stresses are the laws' own float64 twins, all tests at once.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from surgisim.physics.catalogue import Numbers, Term
from surgisim.problem import Problem

NEWTON = 12
"""Steps that the sides may take to come free of stress."""
FREE = 1e-7
"""Of the larger of the load's stress and 1 Pa: what counts as free."""
SMALL = 1e-6
"""Change of a side's logarithmic stretch that its stiffness is read from."""


@dataclass(frozen=True)
class Pressed:
    """n tests of S instants each."""

    time: np.ndarray
    """[s], (n, S)"""
    stretch: np.ndarray
    """Along the load [1], (n, S)."""
    axis: np.ndarray
    """Which of the cube's axes is loaded, (n,)."""


def stress(laws: Mapping[str, Term], values: Mapping[str, Numbers], tests: Pressed) -> np.ndarray:
    """Cauchy stress along the load [Pa], (n, S). Raises Problem where the sides find no equilibrium."""
    rows = {name: term.row(values[name]) for name, term in laws.items()}
    n, count = tests.stretch.shape
    sides = np.stack([(tests.axis + k) % 3 for k in (1, 2)], 1)
    every = np.arange(n)
    log = np.zeros((n, 3))
    memory = {name: np.zeros((n, term.memory)) for name, term in laws.items()}
    found = np.zeros((n, count))
    before = tests.time[:, 0]
    for s in range(count):
        dt = np.maximum(tests.time[:, s] - before, 1e-9)
        trial = log.copy()
        trial[every, tests.axis] = np.log(tests.stretch[:, s])
        # A first guess that keeps the volume.
        trial[every[:, None], sides] -= 0.5 * (trial - log)[every, tests.axis][:, None]
        for _ in range(NEWTON):
            moved = np.stack([trial, trial.copy(), trial.copy()])
            for k in (0, 1):
                moved[k + 1, every, sides[:, k]] += SMALL
            sigma, kept = _stress(laws, rows, moved, log, memory, dt, s > 0)
            left = np.take_along_axis(sigma[0], sides, 1)
            load = np.abs(sigma[0, every, tests.axis])
            if (np.abs(left).max(1) <= FREE * np.maximum(load, 1.0)).all():
                break
            slope = np.stack([(np.take_along_axis(sigma[k + 1], sides, 1) - left) / SMALL for k in (0, 1)], -1)
            step = np.linalg.solve(slope, left[..., None])[..., 0]
            trial[every[:, None], sides] -= np.clip(step, -0.2, 0.2)
        else:
            raise Problem(f"a pressed cube's sides find no equilibrium at instant {s} with {list(laws)}.")
        found[:, s] = sigma[0, every, tests.axis]
        memory = {name: q[0] for name, q in kept.items()}
        log, before = trial, tests.time[:, s]
    return found


def _stress(laws, rows, log, before, memory, dt, moving) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Principal Cauchy stresses [Pa], (3, n, 3), and the memories, of trial logarithmic stretches (3, n, 3)."""
    F = np.exp(log)[..., None] * np.eye(3)
    D = ((log - before) / dt[:, None] if moving else np.zeros_like(log))[..., None] * np.eye(3)
    kept, factor, seen = {}, 1.0, F
    for name, term in laws.items():
        q = np.broadcast_to(memory[name], (*log.shape[:2], term.memory))
        if term.twin_advance is not None and moving:
            q = term.twin_advance(F, D, 0 * log, q, dt[:, None], **rows[name])
        kept[name] = q
        if term.factor is not None:
            factor = factor * term.twin(F, q, **rows[name])
        if term.flow is not None:
            seen = seen @ term.twin(q, **rows[name])
    total = np.zeros_like(F)
    for name, term in laws.items():
        if term.stress is None:
            continue
        stores = term.energy is not None
        sigma = term.cauchy(seen if stores else F, D, kept[name], 0.0, rows[name])
        total = total + (np.asarray(factor)[..., None, None] * sigma if stores else sigma)
    return np.einsum("...ii->...i", total), kept
