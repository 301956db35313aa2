"""From artifacts to a body ready to run."""

import math
from dataclasses import dataclass, replace

import numpy as np

from surgisim.artifacts.body import Body
from surgisim.artifacts.material import Material
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.physics import Physics
from surgisim.mpm.cut import Cut
from surgisim.mpm.grid import Grid
from surgisim.mpm.grip import ANCHOR, Drive, drive
from surgisim.mpm.simulator import Simulator
from surgisim.mpm.stable import check_step, largest_step, wave_speed
from surgisim.physics.catalogue import Term, choose, columns
from surgisim.problem import Problem

Values = dict[str, dict[str, float]]

LEAST_GRIP = 1.0
"""Smallest radius of a grip, in cells."""


@dataclass(frozen=True)
class Prepared:
    """A body on its grid, and what its parameters mean."""

    simulator: Simulator
    terms: tuple[str, ...]
    density: float
    """[kg/m^3]"""
    body: Body

    def theta(self, values: Values) -> np.ndarray:
        """One number a parameter as one row a particle, (P, M)."""
        row = [values[name][param] for name, term in choose(self.terms).items() for param in term.params]
        return np.tile(np.array(row, float), (self.simulator.count, 1))

    def stiffest(self, theta: np.ndarray) -> Values:
        """The largest value of every parameter on any particle: what bounds the step."""
        return _largest(choose(self.terms), theta)

    def per_frame(self, values: Values, fps: float, safety: float = 1.0) -> int:
        """Steps between two frames so that the run is stable."""
        largest = largest_step(choose(self.terms), values, self.density, self.simulator.grid.spacing)
        return max(1, math.ceil(1 / fps / (largest * safety)))

    def drive(
        self,
        motion: Motion,
        values: Values,
        *,
        fps: float,
        per_frame: int,
        frames: int | None = None,
        held: np.ndarray | None = None,
        grip: float = 1.0,
    ) -> Drive:
        """The boundary condition of `motion`; the anchors' spring follows the tissue's modulus in `values`.

        A grip smaller than a cell is widened to one: the grid cannot carry a smaller ball along, and would let
        the tissue slip out of it.
        """
        spacing = self.simulator.grid.spacing
        rate = wave_speed(choose(self.terms), values, self.density) / spacing
        motion = replace(motion, radius=np.maximum(motion.radius, LEAST_GRIP * spacing))
        held = self.body.held if held is None else held
        spring = ANCHOR * rate**2
        return drive(
            motion, self.body.rest, held, fps=fps, per_frame=per_frame, frames=frames, stiffness=spring, grip=grip
        )


def prepare(
    body: Body,
    terms: tuple[str, ...],
    *,
    density: float,
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    carried: np.ndarray | None = None,
    cut: Cut | None = None,
    device: str = "cpu",
) -> Prepared:
    """Lay the grid around the body and every further rest point it has to carry [m], (Q, 3)."""
    points = body.rest if carried is None else np.concatenate([body.rest, carried])
    simulator = Simulator(
        rest=body.rest,
        volume=body.volume,
        density=density,
        grid=Grid.around(points, body.spacing),
        terms=terms,
        gravity=gravity,
        cut=cut,
        device=device,
    )
    return Prepared(simulator, tuple(terms), density, body)


def values_of(physics: Physics) -> Values:
    """Law -> parameter -> value of a physics.json."""
    return {
        law: {name: float(entry["value"]) for name, entry in params.items()} for law, params in physics.terms.items()
    }


def theta_of(physics: Physics, material: Material) -> np.ndarray:
    """Per-particle parameters in the laws' order, (P, M); refuses a material made for other laws."""
    wanted = columns(choose(physics.terms, "physics.json"))
    if list(material.names) != wanted:
        raise Problem(
            f"material.npz has columns {list(material.names)}, but physics.json's laws need {wanted}. "
            "Pass the two files that one estimation wrote."
        )
    return np.asarray(material.values, float)


def checked_per_frame(physics: Physics, material: Material, fps: float) -> int:
    """Steps a frame for the step that travels with the parameters; refuses one too large for them."""
    terms = choose(physics.terms, "physics.json")
    theta = theta_of(physics, material)
    largest = largest_step(terms, _largest(terms, theta), physics.density, physics.grid["spacing"])
    check_step(physics.grid["step"], largest, "physics.json, grid.step")
    return max(1, round(1 / fps / physics.grid["step"]))


def _largest(terms: dict[str, Term], theta: np.ndarray) -> Values:
    top = dict(zip(columns(terms), theta.max(0).tolist(), strict=True))
    return {law: {p: top[f"{law}.{p}"] for p in term.params} for law, term in terms.items()}
