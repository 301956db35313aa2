"""A baseline in place of the method's solver: where it takes the masses, the grid that carries the scene goes."""

import importlib
import math
import pkgutil
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from surgisim import baselines
from surgisim.baselines.springs import HELD, SAFETY, Network, masses, spread, stable_step, swing
from surgisim.mpm.grip import Drive
from surgisim.mpm.nodes import Nodes
from surgisim.mpm.setup import Prepared, Values
from surgisim.mpm.simulator import Run
from surgisim.mpm.stable import shear_speed
from surgisim.physics.catalogue import choose
from surgisim.problem import Problem

PARTS = "run", "springs"
"""Files beside the baselines that are none."""
LOOSE = 1e-3
"""Weight of nodes that stay, beside that of particles which say where they go: hardly any particle tells of some."""


def network(name: str, made: Prepared, modulus: float) -> Network:
    """The baseline's masses and springs on a body; modulus: Young's [Pa]. Raises Problem for a name that is none."""
    known = [m.name for m in pkgutil.iter_modules(baselines.__path__) if m.name not in PARTS]
    if name not in known:
        raise Problem(
            f"config key 'simulation.solver' is '{name}', and there are mpm and, in surgisim/baselines/, {known}. "
            "Choose one of them."
        )
    return importlib.import_module(f"{baselines.__name__}.{name}").network(made.body, modulus)


def run(
    name: str,
    made: Prepared,
    values: Values,
    path: Callable[[int], Drive],
    *,
    fps: float,
    refine: int,
    progress: Callable[[float, float, str], None],
) -> tuple[Run, np.ndarray]:
    """The grid's run that carries the body as the baseline moves it, and its kinetic and elastic energy [J], (T, 2).

    values: the laws' numbers, of which shear modulus and viscosity are taken. path: the boundary condition at so many
    steps a frame. refine: how many times shorter steps are than they may be.
    """
    laws = {name: law for name, law in choose(made.terms).items() if law.energy is not None}
    shear = made.density * shear_speed(laws, {n: law.row(values[n]) for n, law in laws.items()}, made.density) ** 2
    lag = values.get("newtonian", {}).get("eta", 0.0) / shear
    net = network(name, made, 2.5 * shear)
    volume = made.body.volume.astype(float)
    mass = masses(net, made.body.rest.astype(float), made.density * volume)
    per_frame = math.ceil(1 / fps / (SAFETY * stable_step(net, mass, lag))) * refine
    drive = path(per_frame)
    own = replace(drive, member=drive.member[net.vertices], share=drive.share[net.vertices])
    _check_holds(own, name)
    done = swing(net, mass, lag, own, progress)
    along = spread(net, made.body.rest.astype(float))
    u, v = (on_nodes(made.simulator, along, volume, part) for part in (done.u, done.v))
    return Run(u, v, np.zeros((len(u), len(volume), 0), np.float32)), done.energy


def on_nodes(nodes: Nodes, along: sparse.csr_matrix, volume: np.ndarray, masses: np.ndarray) -> np.ndarray:
    """Nodal values (T, A, 3) that carry the particles, (P,) of `volume` [m^3], as nearly as they can where the masses
    take them, (T, V, 3); along: masses to particles, (P, V)."""
    carry = nodes.carry_rest()
    weight = sparse.diags(volume)
    normal = (carry.T @ weight @ carry).tocsc()
    solve = splu(normal + LOOSE * sparse.diags(np.maximum(normal.diagonal(), normal.diagonal().mean()), format="csc"))
    wanted = carry.T @ weight @ along
    return np.stack([solve.solve(np.asarray(wanted @ m)) for m in masses]).astype(np.float32)


def _check_holds(drive: Drive, name: str) -> None:
    """Raises Problem where a grip or a patch of the rim holds no mass."""
    for anchor in range(1, len(drive.path)):
        if not ((drive.member >> anchor & 1) & (drive.share >= HELD)).any():
            raise Problem(
                f"baseline {name}: grip {anchor - 1} holds none of its {len(drive.member)} masses. Enlarge its radius."
            )
