"""Square rods and blocks of tissue, laid on a grid as `thickening` lays a body: what the closed-form cases share."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.body import Body
from surgisim.artifacts.motion import Motion
from surgisim.mpm.setup import Prepared, Values, prepare
from surgisim.mpm.simulator import Run

DENSITY = 1050.0
"""[kg/m^3]"""
THICKNESS = 0.018
"""Side of a rod's cross-section [m]."""
CELLS = 5
"""Default resolution: cells over the thickness, with 8 particles a cell."""
PER_AXIS = 2
"""Particles along each side of a cell."""


def block(size: tuple[float, float, float], spacing: float, clamp: float = 0.0) -> Body:
    """Particles that fill 0..size[0] along x, and `size` about 0 across [m]; what continues to -clamp is held."""
    n = np.round(np.array(size) / spacing * PER_AXIS).astype(int)
    step = np.array(size) / n
    behind = round(clamp / step[0])
    axes = [(np.arange(-behind, n[0]) + 0.5) * step[0]]
    axes += [(np.arange(n[a]) + 0.5) * step[a] - size[a] / 2 for a in (1, 2)]
    rest = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    volume = np.full(len(rest), step.prod())
    return Body(
        rest.astype(np.float32), volume.astype(np.float32), np.full(rest.shape, 0.5, np.float32),
        np.zeros(len(rest), bool), rest[:, 0] < 0, spacing,
    )  # fmt: skip


@dataclass(frozen=True)
class Rod:
    """A block on its grid with its law."""

    made: Prepared
    values: Values
    nodes: np.ndarray
    """Rest positions of the nodes that move [m], (A, 3)."""
    mass: np.ndarray
    """Their masses [kg], (A,)."""

    @property
    def step(self) -> float:
        """The largest stable step [s], which is the default one."""
        return 1.0 / self.made.per_frame(self.values, 1.0)

    def run(self, step: float, every: int, samples: int, begin=None) -> Run:
        """`samples` states after the first, one every `every` steps of `step` [s]; only what is held is held.

        begin: nodal displacement [m] and velocity [m/s], (A, 3) each.
        """
        drive = self.made.drive(
            unmoved(samples + 1), self.values, fps=1 / (step * every), per_frame=every, frames=samples + 1
        )
        begun = {} if begin is None else {"begin": begin}
        return self.made.simulator.run(self.made.theta(self.values), drive, **begun)


def rod(body: Body, values: Values, gravity: tuple[float, float, float] = (0.0, 0.0, 0.0), **engine: str) -> Rod:
    """Lay `body` on its grid; `engine`: precision or form, as for `prepare`."""
    made = prepare(body, tuple(values), density=DENSITY, gravity=gravity, **engine)
    simulator = made.simulator
    return Rod(made, values, simulator.grid.positions()[simulator.place], simulator.mass.numpy().astype(float))


def unmoved(frames: int) -> Motion:
    """No grip at all, for `frames` frames."""
    none = np.zeros(0)
    return Motion(none.reshape(0, 3), none, np.zeros((0, frames, 3)), np.zeros((0, frames), bool), none, "none")


def share(rod: Rod, u: np.ndarray, mode: np.ndarray) -> np.ndarray:
    """How much of `mode` (A, 3) is in each of u (T, A, 3), (T,): the projection weighted with the masses."""
    weighted = rod.mass[:, None] * mode
    return np.einsum("tna,na->t", u.astype(float), weighted) / np.sum(weighted * mode)
