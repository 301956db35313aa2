"""What a clip can tell: intervals of parameters and of dimensionless groups, and who informs them."""

from collections.abc import Mapping

import numpy as np

from surgisim.estimation.gauss_newton import Solution
from surgisim.estimation.search import Search
from surgisim.estimation.support import Support

OPEN_TOLD = 0.5
"""The same of what is open beside the laws, whose priors are narrow."""
RESTS = 0.2
"""Share of a quantity's variance from which on what was taken for granted is named."""
TOLD = 0.1
"""A number counts as told by the clip when its posterior spread is at most this share of the prior's: a modulus to
about 25 % either way (90 %), Poisson's ratio to about .02."""


def identifiability(
    solution: Solution,
    search: Search,
    *,
    phase_of: np.ndarray,
    phase_names: tuple[str, ...],
    density: float,
    length: float,
    independent: float,
    model: Mapping[str, np.ndarray] | None = None,
) -> dict:
    """Parameters and groups with 90 % intervals, the share of information from each phase, and whether told.

    phase_of: phase of every residual, (R,). length: thickness of the body [m].
    independent: share of the residuals that count as independent, because tracking noise is
    correlated along a track and between neighbours; the misfit's own size scales the noise.
    model: for what was taken for granted, by its name, what it adds to the parameters' covariance in search space,
    (M, M). Whatever has a fifth of a quantity's variance is named in its `rests_on`, with its share.
    """
    J, r, spread, model = solution.jacobian, solution.residual, search.spread, model or {}
    information = independent / spread_of(r) * (J.T @ J)
    covariance = np.linalg.inv(information + np.diag(1 / spread**2)) + sum(model.values())
    result = {}
    for name, direction, value, unit, logarithmic, size in _quantities(search, solution.x, density, length):
        sd = float(np.sqrt(direction @ covariance @ direction))
        prior = float(np.sqrt(((direction * spread) ** 2).sum()))
        by_phase = {n: float(((J[phase_of == k] @ direction) ** 2).sum()) for k, n in enumerate(phase_names)}
        total = sum(by_phase.values())
        low, high = (
            (value * np.exp(-1.645 * sd), value * np.exp(1.645 * sd))
            if logarithmic
            else (
                value - 1.645 * sd * size,
                value + 1.645 * sd * size,
            )
        )
        edge = _at_edge(search, solution.x, direction)
        told = sd <= (OPEN_TOLD if name in {u.name for u in search.open} else TOLD) * prior and not edge
        result[name] = {
            "value": float(value),
            "low": float(low),
            "high": float(high),
            "unit": unit,
            "told": bool(told),
            "at_edge": edge,
            "rests_on": {
                n: round(float(share), 3)
                for n, c in model.items()
                if (share := direction @ c @ direction / sd**2) > RESTS
            },
            "phases": {n: round(v / total, 3) if total > 0 else 0.0 for n, v in by_phase.items()},
        }
    return result


def spread_of(r: np.ndarray) -> float:
    """Mean square of weighted residuals, 1 at least: how many times larger their variance is than was stated."""
    used = r != 0
    return max(1.0, float(np.mean(r[used] ** 2))) if used.any() else 1.0


def _at_edge(search: Search, x: np.ndarray, direction: np.ndarray) -> bool:
    """Whether a quantity rests on a parameter at the limit of its range: there the range answered, not the clip."""
    low, high = search.bounds
    margin = 0.01 * (high - low)
    return bool(((direction != 0) & ((x < low + margin) | (x > high - margin))).any())


def _quantities(search: Search, x: np.ndarray, density: float, length: float):
    """Name, gradient in search space, value, unit, whether logarithmic, and what 1 in search space is of the unit."""
    values = search.values(x)
    place = {name: k for k, name in enumerate(search.names)}
    for k, (law, param, p) in enumerate(search.free):
        yield f"{law}.{param}", np.eye(len(x))[k], values[law][param], p.unit, p.logarithmic, 1.0
    for k, u in enumerate(search.open, len(search.free)):
        yield (
            u.name,
            np.eye(len(x))[k],
            u.size * (np.exp(x[k]) if u.logarithmic else x[k]),
            u.unit,
            u.logarithmic,
            u.size,
        )
    moduli = [n for n in search.names if n.endswith(".E")]
    viscosities = [n for n in search.names if n.endswith(".eta")]
    for m in moduli:
        E = values[m.split(".")[0]]["E"]
        for v in viscosities:
            eta = values[v.split(".")[0]]["eta"]
            yield f"{v} / {m}", np.eye(len(x))[place[v]] - np.eye(len(x))[place[m]], eta / E, "s", True, 1.0
        yield f"{m} / (density length^2)", np.eye(len(x))[place[m]], E / (density * length**2), "1/s^2", True, 1.0


def in_words(
    table: dict, support: Support, grip: float, steps: int, before: float, after: float, damping: float | None
) -> str:
    """The outcome of a fit for a person."""
    told = [n for n, q in table.items() if q["told"]]
    edges = [n for n, q in table.items() if q["at_edge"]]
    untold = [n for n, q in table.items() if not q["told"] and not q["at_edge"]]
    parts = [
        f"On frames that were never fitted, simulated and tracked points of the moving tissue are "
        f"{after * 1e3:.3f} mm apart on average ({before * 1e3:.3f} mm with default parameters), "
        f"with {steps} steps a frame.",
        f"It moves most like tissue held {support.depth * 1e3:.0f} mm below its surface that goes on "
        f"{support.beyond * 1e3:.0f} mm beyond what is seen and is {'held' if support.rim else 'free'} there.",
    ]
    if grip < 1:
        parts.append(
            f"Held firmly, the tissue would turn inside out under the grip's path; it is held with {grip:g} of the "
            "full stiffness and slips."
        )
    if told:
        parts.append("The clip tells " + ", ".join(_quoted(n, table[n]) for n in told) + ".")
    if untold:
        parts.append("It cannot tell " + ", ".join(untold) + ": those stay near where the fit began.")
    if edges:
        parts.append(
            "At the limit of the range that was searched, so more likely making up for something else than measured: "
            + ", ".join(_quoted(n, table[n]) for n in edges)
            + "."
        )
    resting = {cause for n in told for cause in table[n]["rests_on"]}
    for cause in sorted(resting):
        names = ", ".join(n for n in told if cause in table[n]["rests_on"])
        parts.append(f"How far {names} may be off rests on what was taken for granted: {cause}.")
    if damping is not None:
        parts.append(f"At this step and grid the method itself damps free vibration by {abs(damping):.2g} per second.")
    return " ".join(parts)


def _quoted(name: str, q: dict) -> str:
    unit = "" if q["unit"] == "1" else f" {q['unit']}"
    return f"{name} = {q['value']:.3g}{unit} ({q['low']:.3g} to {q['high']:.3g})"
