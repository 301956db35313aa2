"""The largest time step an explicit run may take."""

import math
from collections.abc import Mapping

import numpy as np

from surgisim.mpm.grip import SHARP_ANCHOR
from surgisim.physics.catalogue import Numbers, Term
from surgisim.problem import Problem


def wave_speed(terms: Mapping[str, Term], rows: Mapping[str, Numbers], density: float) -> float:
    """Speed of the pressure wave at rest [m/s]: sqrt((lambda + 2 mu) / rho), summed over the laws.

    rows: every law's columns, the largest of any particle.
    """
    modulus = sum(t.wave_modulus(**rows[n]) for n, t in terms.items() if t.wave_modulus)
    factor = math.prod(max(1.0, t.stiffens(**rows[n])) for n, t in terms.items() if t.stiffens)
    return math.sqrt(factor * modulus / density)


def shear_speed(terms: Mapping[str, Term], rows: Mapping[str, Numbers], density: float) -> float:
    """Speed of the shear wave at rest [m/s]: sqrt(mu / rho), summed over the laws that store energy.

    mu is the mean slope of the laws' own stress in a small simple shear along x, y and z.
    """
    modulus, small, still = 0.0, 1e-4, np.zeros((3, 3))
    for name, term in terms.items():
        if term.energy is not None and term.stress is not None:
            memory = np.zeros(max(1, term.memory))
            for a in range(3):
                shear = small * np.outer(np.eye(3)[a], np.eye(3)[a - 1])
                up, down = (term.cauchy(np.eye(3) + s * shear, still, memory, 0.0, rows[name]) for s in (1, -1))
                modulus += float((up - down)[a, a - 1]) / (2 * small) / 3
    factor = math.prod(max(1.0, t.stiffens(**rows[n])) for n, t in terms.items() if t.stiffens)
    return math.sqrt(factor * modulus / density)


def largest_step(terms: Mapping[str, Term], rows: Mapping[str, Numbers], density: float, spacing: float) -> float:
    """Largest stable step [s]: 4 / (d + sqrt(d^2 + 4 w^2)), where w^2 dt^2 + 2 d dt = 4.

    w is the highest circular frequency of tissue and springs: w^2 = max(16 c^2, 6 c^2 + .8 a s^2) / dx^2 + k / rho, c
    and s the speeds of pressure and shear waves, a the anchors' stiffness (grip.py), k the springs of body forces
    [N/m^4]. d is the highest rate at which lagging viscous forces slow anything: 10 eta / (rho dx^2) and the dampers of
    body forces [1/s]. The highest eigenvalues found on slabs, rods and sheets of one cell, turned against their grid,
    are 3.9-6.0 c^2 / dx^2 and 4.9-7.0 eta / (rho dx^2); what is beyond serves stretched tissue: free bodies squeezed
    by half and thrown about stay whole.
    """
    viscosity, spring, damper = (
        sum(slot(**rows[n]) for n, t in terms.items() if (slot := getattr(t, kind)))
        for kind in ("viscosity", "spring", "damper")
    )
    c, shear = wave_speed(terms, rows, density), shear_speed(terms, rows, density)
    w2 = max(16 * c**2, 6 * c**2 + 0.8 * SHARP_ANCHOR * shear**2) / spacing**2 + spring / density
    d = 10 * viscosity / (density * spacing**2) + damper
    return 4 / (d + math.sqrt(d**2 + 4 * w2))


JUMP = 0.25
"""Of a cell, that an anchor may move in one step."""


def check_step(step: float, largest: float, where: str = "step") -> None:
    """Refuse a step that would blow up."""
    if step > largest * (1 + 1e-9):
        raise Problem(
            f"{where}: a step of {step:.3e} s is too large for this tissue's wave speed and viscosity; the largest "
            f"stable one is {largest:.3e} s. Take that, a coarser grid, or a softer tissue."
        )


def check_speed(path: np.ndarray, step: float, spacing: float, fps: float) -> None:
    """Raise Problem where an anchor of `path` [m], (J, S + 1, 3), runs through more than a share of a cell in a step.

    Springs hold what is gripped: what jumps ahead of it by a good part of a cell tears it instead of carrying it.
    """
    if path.shape[1] < 2:
        return
    jumps = np.linalg.norm(np.diff(path, axis=1), axis=-1)
    worst = float(jumps.max())
    if worst > JUMP * spacing:
        j, n = np.unravel_index(jumps.argmax(), jumps.shape)
        needed = math.ceil(1 / (fps * step) * worst / (JUMP * spacing))
        raise Problem(
            f"motion: {'the base' if j == 0 else f'grip {j - 1}'} moves {1e3 * worst:.2f} mm in one step at "
            f"{n * step:.3f} s, but at most {1e3 * JUMP * spacing:.2f} mm, a quarter of a cell, can be followed. Check "
            f"the path's units and frame rate, or take at least {needed} steps per frame."
        )
