"""From artifacts to a body ready to run."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import eigsh

from surgisim.artifacts.body import Body
from surgisim.artifacts.material import Material
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.physics import Physics
from surgisim.mpm.grid import Grid
from surgisim.mpm.grip import ANCHOR, BASE, SHARP_ANCHOR, Drive, drive
from surgisim.mpm.kink import Ball
from surgisim.mpm.simulator import Simulator
from surgisim.mpm.stable import check_speed, check_step, largest_step, shear_speed, wave_speed
from surgisim.mpm.tear import Severing, Tear, severed
from surgisim.mpm.updated import Updated
from surgisim.physics.catalogue import Numbers, Term, choose, columns, defaults
from surgisim.physics.place import Place, rows
from surgisim.problem import Problem

Values = dict[str, Numbers]
"""Law -> parameter -> value."""

SKIN = 1.0
"""Width of a filmed grip's skin, in particles: where a grip is searched for, see `prepare`."""
LEAST_GRIP, LEAST_SHARP = 1.0, 0.5
"""Smallest radius of a grip, in cells: of one that splines alone carry, and of one at whose skin the displacement may
bend (kink.py), which still holds a few particles then."""


@dataclass(frozen=True)
class Prepared:
    """A body on its grid, and what its parameters mean."""

    simulator: Simulator | Updated
    terms: tuple[str, ...]
    density: float
    """[kg/m^3]"""
    body: Body
    places: Mapping[str, Place] = field(default_factory=dict)
    """Laws that act in one place only."""

    def theta(
        self, values: Values, places: Mapping[str, Place] | None = None, held: np.ndarray | None = None
    ) -> np.ndarray:
        """The laws' columns, one row a particle, (P, M); `held` as for `drive`."""
        places = self.places if places is None else places
        masks = {"held": self.body.held if held is None else held, "surface": self.body.surface}
        return rows(choose(self.terms), values, places, self.simulator.rest, self.simulator.volume_p, masks)

    def stiffest(self, theta: np.ndarray) -> Values:
        """The largest value of every column on any particle: what bounds the step."""
        return largest_rows(choose(self.terms), theta)

    def per_frame(self, values: Values, fps: float, safety: float = 1.0) -> int:
        """Steps between two frames so that the run is stable."""
        return self.per_frame_of(self.stiffest(self.theta(values)), fps, safety)

    def per_frame_of(self, rows: Values, fps: float, safety: float = 1.0) -> int:
        """The same for the largest columns, as `stiffest` gives them."""
        largest = largest_step(choose(self.terms), rows, self.density, self.simulator.grid.spacing)
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
        places: Mapping[str, Place] | None = None,
        firm: bool = True,
        late: np.ndarray | None = None,
    ) -> Drive:
        """The boundary condition of `motion`; the anchors' spring follows the tissue's modulus in `values` at `places`.

        late: as in `grip.drive`; the motion's own if None.

        firm: whether the base is known to hold, as in a recording that says so. Where it is guessed, as in a video,
        one that gives way a little is the better guess: held hard at the wrong place, a release fits a modulus many
        times too high.

        A grip smaller than a cell is widened to one where the body was laid without it (`prepare`): splines cannot
        carry a smaller ball along, and would let the tissue slip out of it. Otherwise one of half a cell is carried.
        """
        spacing = self.simulator.grid.spacing
        laws = choose(self.terms)
        local = self.places if places is None else places
        # What is stiffer in one place only is no reason to hold everything more firmly.
        base = {n: t.row(values[n]) for n, t in laws.items() if t.energy is not None and n not in local}
        alone = {n: laws[n] for n in base}
        shear, pressure = (of(alone, base, self.density) / spacing for of in (shear_speed, wave_speed))
        least = LEAST_SHARP if self.simulator.kinks.count else LEAST_GRIP
        motion = replace(motion, radius=widened(motion.radius, spacing, least))
        held = self.body.held if held is None else held
        spring = (SHARP_ANCHOR if self.simulator.kinks.count else ANCHOR) * shear**2
        path = drive(
            motion,
            self.body.rest,
            self.body.volume,
            held,
            fps=fps,
            per_frame=per_frame,
            frames=frames,
            stiffness=spring,
            grip=grip,
            late=np.repeat(motion.late[:, None], motion.active.shape[-1], 1) if late is None else late,
        )
        check_speed(path.path, path.step, spacing, fps)
        # A particle that a held box cuts is held as firmly as a whole one: the box's plane is.
        whole = held * np.maximum(1.0, np.median(self.body.volume) / self.body.volume)
        path = replace(path, share=np.maximum(path.share, whole))
        inertia = self._held_motion(whole)
        # Tissue that cannot be squeezed pushes on its base far harder than it shears it.
        path.stiffness[0] *= max(1 / max(1.0, inertia), BASE * pressure**2 / inertia / spring if firm else 0.0)
        path = replace(path, share=path.share * self._firmer(self.theta(values, places, held)))
        for name, term in laws.items():
            if term.drive is not None:
                path = term.drive(path, **values[name])
        return path

    def _firmer(self, theta: np.ndarray) -> np.ndarray | float:
        """How many times stiffer than the rest each particle is, (P,): anchors hold it as much more firmly."""
        laws, firmer = choose(self.terms), 1.0
        at = dict(zip(columns(laws), theta.T, strict=True))
        for name, term in laws.items():
            if term.factor is not None and term.stiffens is not None:
                firmer = firmer * term.stiffens(**{c: at[f"{name}.{c}"] for c in term.row(defaults(term))})
        return firmer

    def _held_motion(self, held: np.ndarray) -> float:
        """Largest share of any motion's inertia that is held tissue's: what a spring on that counts for in the step.

        held: how firmly each particle is, (P,).
        """
        if not held.any() or isinstance(self.simulator, Updated):
            return 1.0
        root = np.sqrt(self.simulator.node_mass(np.ones(len(held))))
        weight = self._carried.multiply(np.sqrt(self.simulator.volume_p * held)[:, None]) @ sparse.diags(1 / root)
        return float(eigsh(weight.T @ weight, 1, v0=root, tol=1e-2, return_eigenvectors=False)[0])

    @cached_property
    def _carried(self) -> sparse.csr_matrix:
        """Nodes to particles, (P, A)."""
        return self.simulator.carry_rest()


def prepare(
    body: Body,
    terms: tuple[str, ...],
    *,
    density: float,
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    carried: np.ndarray | None = None,
    cut: Severing | None = None,
    places: Mapping[str, Place] | None = None,
    device: str = "cpu",
    precision: str = "single",
    threads: int = 1,
    form: str = "total",
    grips: Motion | None = None,
    skin: float = 0.0,
) -> Prepared:
    """Lay the grid around the body and every further rest point it has to carry [m], (Q, 3).

    form: 'total', or 'updated' for the paper's (single precision, one thread, no adjoint, no cut). grips: a motion that
    will be replayed, so that the tissue may bend sharply at the skin of what it grips; skin: particles' widths in which
    that bend is spread out, so that a grip that is searched for can be moved without particles changing sides at once.
    """
    given = {
        "rest": body.rest, "volume": body.volume, "density": density,
        "grid": Grid.around(body.rest, body.spacing, carried),
        "terms": terms, "gravity": gravity, "cut": severed(Tear(body.torn) if len(body.torn) else None, cut),
        "device": device,
    }  # fmt: skip
    if form == "updated":
        return Prepared(Updated(**given), tuple(terms), density, body, places or {})
    held = () if grips is None else zip(grips.center_rest, widened(grips.radius, body.spacing), strict=True)
    wide = skin * float(np.cbrt(np.median(body.volume)))
    balls = tuple(Ball(np.asarray(c, float), float(r), wide) for c, r in held)
    simulator = Simulator(**given, precision=precision, threads=threads, balls=balls)
    return Prepared(simulator, tuple(terms), density, body, places or {})


def widened(radius: np.ndarray, spacing: float, least: float = LEAST_SHARP) -> np.ndarray:
    """Radii of grips [m], (J,), as a grid of this spacing [m] carries them; least: in cells."""
    return np.maximum(radius, least * spacing)


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
    largest = largest_step(terms, largest_rows(terms, theta), physics.density, physics.grid["spacing"])
    check_step(physics.grid["step"], largest, "physics.json, grid.step")
    return max(1, round(1 / fps / physics.grid["step"]))


def largest_rows(terms: Mapping[str, Term], theta: np.ndarray) -> Values:
    """Law -> column -> its largest value on any particle, from theta (P, M)."""
    top = dict(zip(columns(terms), theta.max(0).tolist() if theta.size else [], strict=True))
    return {law: {c: top[f"{law}.{c}"] for c in term.row(defaults(term))} for law, term in terms.items()}
