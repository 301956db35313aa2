"""The four phases of the optimisation.

1. coarse: the canonical scene and the field together;
2. trajectory: the same, and neighbours have to move alike;
3. refine: the canonical scene rests while the field is refined, neighbours still moving alike;
4. canonical: the field is frozen, and the canonical scene alone is refined.
"""

from dataclasses import dataclass

from surgisim.problem import Problem


@dataclass(frozen=True)
class Phase:
    number: int
    name: str
    moves_canonical: bool
    moves_field: bool
    trajectory: bool
    """Whether the trajectory term is part of the loss."""
    recolours: bool
    """Whether colours may change in time."""


PHASES = (
    Phase(1, "coarse", True, True, False, False),
    Phase(2, "trajectory", True, True, True, True),
    Phase(3, "refine", False, True, True, True),
    Phase(4, "canonical", True, False, False, True),
)


def phase_at(iteration: int, iterations: int, ends: tuple[float, float, float]) -> Phase:
    """The phase an iteration (counted from 0) belongs to; ends: fractions where phases 1, 2 and 3 end."""
    if not 0 <= ends[0] <= ends[1] <= ends[2] <= 1:
        raise Problem(f"reconstruction: key 'phases' is {list(ends)}, but three rising fractions of 1 are wanted.")
    return PHASES[sum(iteration >= round(end * iterations) for end in ends)]


def rate_at(iteration: int, iterations: int, end: float) -> float:
    """Share of the first step size that is left: falls exponentially to `end`."""
    return float(end ** (iteration / max(iterations - 1, 1)))
