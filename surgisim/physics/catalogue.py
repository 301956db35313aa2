"""What a law is, and which laws there are.

A law is one module in `terms/` holding one `TERM`; its file name is its name in configs,
artifacts and verdicts. Nothing is registered anywhere else.
"""

import importlib
import pkgutil
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Literal

from surgisim.physics import terms
from surgisim.problem import Problem


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
    """Value at which the law adds nothing; a diagnosis compares against it."""
    logarithmic: bool = True
    """Whether a fit searches its logarithm (moduli, viscosities) or itself (ratios, angles)."""


@dataclass(frozen=True, kw_only=True)
class Term:
    """A constitutive law."""

    params: dict[str, Param]
    stress: Callable[..., Any]
    """`wp.func (F, D, theta) -> Cauchy stress [Pa]`: F deformation gradient, D rate of stretching [1/s]."""
    twin: Callable[..., Any]
    """`numpy (F, D, **params) -> Cauchy stress [Pa]` in float64, the readable form the tests believe."""
    energy: Callable[..., Any] | None = None
    """`numpy (F, **params) -> J/m^3` of rest volume, where the law stores energy."""
    wave_modulus: Callable[..., float] | None = None
    """`(**params) -> lambda + 2 mu [Pa]` at rest: what the stable step is computed from."""
    viscosity: Callable[..., float] | None = None
    """`(**params) -> eta [Pa s]` at rest, for the same purpose."""
    enters: Literal["stress"] = "stress"
    about: str = ""
    """The file's docstring, filled in by `catalogue`."""


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


def columns(chosen: dict[str, Term]) -> list[str]:
    """'term.parameter' of every column of theta, in order."""
    return [f"{name}.{param}" for name, term in chosen.items() for param in term.params]
