"""How fast the method itself would bring the fitted body to rest, at the step and spacing of its fit."""

import numpy as np

from surgisim.artifacts.motion import Motion
from surgisim.mpm.setup import Values, prepare
from surgisim.physics.catalogue import choose

DURATION, SAMPLES, STRAIN = 0.4, 40, 1e-3
"""How long the body swings [s], how often it is looked at, and how far it is strained."""


def numerical_damping(body, density: float, values: Values, held: np.ndarray, step: float, device: str) -> float:
    """Decay of free vibration without any law that loses energy [1/s]: what a fitted viscosity cannot be told from.

    The body's upper side is struck sideways; the energy of its motion, its tissue and the springs of its base is
    followed for DURATION. Half the slope of its logarithm is the decay of the amplitude.
    """
    laws = {n: t for n, t in choose(values).items() if t.energy is not None and not t.memory}
    made = prepare(body, tuple(laws), density=density, device=device)
    simulator = made.simulator
    nodes = simulator.grid.positions()[simulator.place % simulator.grid.count]
    base = body.rest[held].astype(float) if held.any() else body.rest.astype(float).mean(0, keepdims=True)
    height = np.linalg.norm(nodes - base.mean(0), axis=1)
    reach = float(np.ptp(body.rest.astype(float), axis=0).max())
    stiffness = sum(t.wave_modulus(**t.row(values[n])) for n, t in laws.items() if t.wave_modulus)
    v = np.zeros_like(nodes)
    v[:, 0] = STRAIN * np.sqrt(stiffness / density) * height / reach
    none = np.zeros(0)
    still = Motion(
        none.reshape(0, 3), none, np.zeros((0, SAMPLES + 1, 3)), np.zeros((0, SAMPLES + 1), bool), none, "none"
    )
    every = max(1, round(DURATION / SAMPLES / step))
    drive = made.drive(
        still, values, fps=1 / (every * step), per_frame=every, frames=SAMPLES + 1, held=held, firm=False
    )
    run = simulator.run(made.theta(values), drive, begin=(np.zeros_like(v), v))
    energy = np.array([_energy(made, values, drive, held, u, w) for u, w in zip(run.u, run.v, strict=True)])
    time = np.arange(SAMPLES + 1) * every * step
    return float(-np.polyfit(time, np.log(energy), 1)[0] / 2)


def _energy(made, values: Values, drive, held: np.ndarray, u: np.ndarray, v: np.ndarray) -> float:
    """Of motion, of strained tissue, and of the base's springs [J]."""
    simulator = made.simulator
    index, link = simulator.rest_links
    at = u.astype(float)[index]
    F = np.eye(3) + np.einsum("pka,pkb->pab", at, link[..., 1:])
    volume = simulator.volume_p
    stored = sum(float((t.energy(F, **t.row(values[n])) * volume).sum()) for n, t in choose(made.terms).items())
    away = np.einsum("pka,pk->pa", at[held], link[held, :, 0])
    springs = 0.5 * made.density * float(np.einsum("p,pa,ab,pb->", volume[held], away, drive.stiffness[0], away))
    return 0.5 * float((simulator.mass.numpy() * (v.astype(float) ** 2).sum(-1)).sum()) + stored + springs
