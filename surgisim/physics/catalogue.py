"""What a law is, and which laws there are.

A law is one module in `terms/` holding one `TERM`; its file name is its name in configs,
artifacts and verdicts. Nothing is registered anywhere else.

A law fills the slots through which it enters. Its device functions are written once for single and double
precision: arguments are `Any`, and a literal takes the type of what it meets, `F.dtype(2.0)`.
"""

import importlib
import pkgutil
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, Literal

from surgisim.physics import terms
from surgisim.problem import Problem

Numbers = dict[str, float]


@dataclass(frozen=True)
class Param:
    """One number a law needs."""

    unit: str
    low: float
    """Lower end of the range a fit may search."""
    high: float
    """Upper end of that range."""
    default: float
    """Where a fit starts, and what a simulation without a fit uses."""
    off: float | None = None
    """Value at which the law adds nothing; a diagnosis compares against it, and a local law fades out to it."""
    logarithmic: bool = True
    """Whether a fit searches its logarithm (moduli, viscosities) or itself (ratios, angles)."""
    total: bool = False
    """Whether the number is a sum over the law's place (a force, a mass), to be shared out per cubic metre."""
    outside: Literal["fades", "stays", "grows"] = "fades"
    """What becomes of it outside the place of a local law.

    It fades to its off value, stays what it is, or grows without bound, as a cap does that is never reached there. A
    total that does not fade is shared out over all tissue that the law acts on.
    """


@dataclass(frozen=True, kw_only=True)
class Term:
    """A law and the slots through which it enters; an empty slot is None.

    F deformation gradient, D rate of stretching [1/s], R rotation of F, q the law's own memory (starts at zero),
    theta its columns at one particle, t time [s], u displacement [m], v velocity [m/s], rho density [kg/m^3].
    """

    params: dict[str, Param]
    twin: Callable[..., Any] | None = None
    """The slot's readable form in float64 numpy, its columns by name; what the tests believe.

    stress: `(F, D, **columns)` or, with memory or clock, `(F, D, q, t, **columns) -> Cauchy [Pa]`;
    factor: `(F, q, **columns) -> number`; flow: `(q, **columns) -> G`;
    force: `(u, v, q, rho, t, **columns) -> [N/m^3]`; mass and drive: None, they are numpy already.
    """
    stress: Callable[..., Any] | None = None
    """`wp.func (F, D, theta)`, or `(F, D, R, q, theta, t)` where memory or clock are needed, -> Cauchy stress [Pa]."""
    factor: Callable[..., Any] | None = None
    """`wp.func (F, q, theta) -> number` that multiplies the stress of every law that stores energy."""
    flow: Callable[..., Any] | None = None
    """`wp.func (q, theta) -> G`: every law that stores energy sees F G instead of F."""
    force: Callable[..., Any] | None = None
    """`wp.func (u, v, q, rho, theta, t) -> force [N/m^3]`."""
    advance: Callable[..., Any] | None = None
    """`wp.func (F, D, R, u, q, theta, dt) -> q` one step later; the other slots see the new memory."""
    twin_advance: Callable[..., Any] | None = None
    """`numpy (F, D, u, q, dt, **columns) -> q`."""
    memory: int = 0
    """How many numbers q holds."""
    mass: str | None = None
    """The column that is added to the density [kg/m^3]."""
    drive: Callable[..., Any] | None = None
    """`(Drive, **params) -> Drive`: moves, loosens or tightens the grips and the held base."""
    energy: Callable[..., Any] | None = None
    """`numpy (F, **columns) -> J/m^3` of rest volume, where the law stores energy."""
    columns: Callable[..., Numbers] | None = None
    """`(**params) -> columns of theta` where they are not the parameters themselves (angles to a direction)."""
    spread: Callable[..., dict[str, Any]] | None = None
    """`(rest (P, 3), **params) -> columns (P,)` that differ from particle to particle (the delay of a wave)."""
    wave_modulus: Callable[..., float] | None = None
    """`(**columns) -> lambda + 2 mu [Pa]` at rest: what the stable step is computed from."""
    viscosity: Callable[..., float] | None = None
    """`(**columns) -> eta [Pa s]` at rest, for the same purpose."""
    spring: Callable[..., float] | None = None
    """`(**columns) -> stiffness of its force by displacement [N/m^4]`, for the same purpose."""
    damper: Callable[..., float] | None = None
    """`(**columns) -> rate at which its force slows tissue [1/s]`, for the same purpose."""
    stiffens: Callable[..., float] | None = None
    """`(**columns) -> largest factor` of a law that multiplies others, for the same purpose."""
    place: Literal["everywhere", "somewhere", "either"] = "either"
    """Where the law may act: on the whole body, in a blob, or both."""
    on: Literal["body", "held", "surface"] = "body"
    """Which tissue there it acts on: all of it, what the base holds, or what lies on the seen surface."""
    rests: bool = True
    """Whether tissue at rest is free of its stress and force in the first frame."""
    balanced: bool = False
    """Whether the surroundings hold its stress at rest in equilibrium, as they do in what a camera first sees."""
    example: Numbers = field(default_factory=dict)
    """Values that tests use where the defaults would switch the law off."""
    about: str = ""
    """The file's docstring, filled in by `catalogue`."""

    @property
    def on_device(self) -> bool:
        """Whether the law has columns on the particles."""
        slots = (self.stress, self.factor, self.flow, self.force, self.advance, self.mass)
        return any(s is not None for s in slots)

    @property
    def enters(self) -> str:
        """Its slots in words."""
        slots = ("stress", "factor", "flow", "force", "mass", "drive")
        return " and ".join(s for s in slots if getattr(self, s) is not None)

    @property
    def wide(self) -> bool:
        """Whether its stress asks for memory and clock."""
        return self.stress is not None and len(self.stress.input_types) > 3

    def cauchy(self, F, D, q, t: float, row: Numbers):
        """Its stress in float64 [Pa], (..., 3, 3), from the twin."""
        return self.twin(F, D, q, t, **row) if self.wide else self.twin(F, D, **row)

    def row(self, values: Numbers) -> Numbers:
        """Its columns, by name, for one set of parameters."""
        if not self.on_device:
            return {}
        return dict(values) if self.columns is None else self.columns(**values)


def catalogue() -> dict[str, Term]:
    """Every law by name."""
    found = {}
    for module in pkgutil.iter_modules(terms.__path__, f"{terms.__name__}."):
        loaded = importlib.import_module(module.name)
        object.__setattr__(loaded.TERM, "about", loaded.__doc__)
        found[module.name.rpartition(".")[2]] = loaded.TERM
    return found


def choose(names: Iterable[str], where: str = "config key 'estimation.terms'") -> dict[str, Term]:
    """The laws asked for, in the order asked."""
    known, names = catalogue(), list(names)
    missing = [n for n in names if n not in known]
    if missing:
        raise Problem(
            f"{where} names {missing}, and surgisim/physics/terms/ holds {sorted(known)}. "
            "Add a file of that name there, or correct the name."
        )
    return {n: known[n] for n in names}


def defaults(term: Term) -> Numbers:
    """Start value of every parameter."""
    return {name: p.default for name, p in term.params.items()}


def columns(chosen: dict[str, Term]) -> list[str]:
    """'term.column' of every column of theta, in order."""
    return [f"{name}.{column}" for name, term in chosen.items() for column in term.row(defaults(term))]
