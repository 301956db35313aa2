"""What a clip can tell: intervals of parameters and of dimensionless groups, and who informs them."""

from collections.abc import Mapping

import numpy as np

from surgisim.estimation.gauss_newton import WIDTH, Solution
from surgisim.estimation.search import Search
from surgisim.estimation.support import Support

OPEN_TOLD = 0.5
"""The same of what is open beside the laws, whose priors are narrow."""
RESTS = 0.2
"""Share of a quantity's variance from which on what was taken for granted is named."""
FREE, FREELY = "release", 0.5
"""The phase in which no grip drives the tissue, and the least share of the information on E or eta that must
come from there: while tissue is driven, an error of the grip's path in time looks like either."""
NINETY = 1.645
"""Standard deviations from the middle to either end of a 90 % interval."""
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
    region: np.ndarray,
    model: Mapping[str, np.ndarray] | None = None,
    wider: float = 1.0,
) -> dict:
    """Parameters and groups with 90 % intervals, the share of information from each phase, and whether told.

    phase_of: phase of every residual, (R,). length: thickness of the body [m].
    independent: share of the residuals that count as independent, because tracking noise is
    correlated along a track and between neighbours; the misfit's own size scales the noise, and where regions of the
    tissue pull the numbers apart by more than that, intervals are as wide as they do (`regional`). region: where every
    residual was seen, (R,) int.
    model: for what was taken for granted, by its name, what it adds to the parameters' covariance in search space,
    (M, M). Whatever has a fifth of a quantity's variance is named in its `rests_on`, with its share.
    wider: how many times wider intervals are than all that says, up to what the prior allows.
    """
    J, r, spread, model = solution.jacobian, solution.residual, search.spread, model or {}
    covariance = regional(J, r, independent / spread_of(r), spread, region) + sum(model.values())
    known = np.append(spread[: len(search.free)], [u.before or u.spread for u in search.open])
    result = {}
    for name, direction, value, unit, logarithmic, size in _quantities(search, solution.x, density, length):
        alone = float(np.sqrt(direction @ covariance @ direction))
        allowed, prior = (float(np.sqrt(((direction * of) ** 2).sum())) for of in (spread, known))
        sd = min(wider * alone, max(alone, allowed))
        by_phase = {n: float(((J[phase_of == k] @ direction) ** 2).sum()) for k, n in enumerate(phase_names)}
        total = sum(by_phase.values())
        low, high = (
            (value * np.exp(-NINETY * sd), value * np.exp(NINETY * sd))
            if logarithmic
            else (value - NINETY * sd * size, value + NINETY * sd * size)
        )
        edge = _at_edge(search, solution.x, direction)
        owed = {n: float(direction @ c @ direction) / alone**2 for n, c in model.items()}
        told = sd <= (OPEN_TOLD if name in {u.name for u in search.open} else TOLD) * prior and not edge
        if ".E" in name or ".eta" in name:
            told = told and total > 0 and by_phase.get(FREE, 0.0) > FREELY * total
        result[name] = {
            "value": float(value),
            "low": float(low),
            "high": float(high),
            "unit": unit,
            "told": bool(told),
            "at_edge": edge,
            "rests_on": {n: round(share, 3) for n, share in owed.items() if share > RESTS},
            "phases": {n: round(v / total, 3) if total > 0 else 0.0 for n, v in by_phase.items()},
        }
    return result


def regional(J: np.ndarray, r: np.ndarray, share: float, spread: np.ndarray, region: np.ndarray) -> np.ndarray:
    """Covariance in search space, (M, M), that holds where parts of the tissue ask for different numbers, too.

    J: derivative, (R, M); r: weighted residuals, (R,); share: how much of a residual's square counts; spread: of the
    prior, (M,); region: which errors may go together, (R,) int. Where the model is right and its noise as stated,
    regions pull at the numbers as much as the information says, and this is its inverse; no direction is taken to be
    surer than that.
    White, Maximum likelihood estimation of misspecified models, Econometrica 50, 1982; clusters as in Liang and Zeger,
    Longitudinal data analysis using generalized linear models, Biometrika 73, 1986.
    """
    root, among, turn = _pulled_apart(J, r, share, spread, region)
    wide = root @ turn
    return (wide * np.maximum(among, 1.0)) @ wide.T


def overstated(J: np.ndarray, r: np.ndarray, share: float, spread: np.ndarray, region: np.ndarray) -> float:
    """How many times less differences of the misfit tell than they say, 1 at least: as `regional`, on average.

    Pauli, Racugno and Ventura, Bayesian composite marginal likelihoods, Statistica Sinica 21 (2011).
    """
    return float(np.maximum(_pulled_apart(J, r, share, spread, region)[1], 1.0).mean())


def _pulled_apart(
    J: np.ndarray, r: np.ndarray, share: float, spread: np.ndarray, region: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A root of the covariance that the information gives, (M, M), how many times more than that regions pull at its
    directions, (M,), and those directions, (M, M)."""
    weight = np.minimum(1.0, WIDTH / np.maximum(np.abs(r), 1e-12))
    pulls = np.zeros((int(region.max()) + 1, J.shape[1]))
    np.add.at(pulls, region, share * (weight * r)[:, None] * J)
    count = len(np.unique(region))
    value, vector = np.linalg.eigh(share * (J.T @ J) + np.diag(1 / spread**2))
    root = vector / np.sqrt(value)
    # What a region asks for, the fit has already followed in part: as many numbers as there are.
    left = count / max(count - J.shape[1], 1)
    among, turn = np.linalg.eigh(left * (pulls @ root).T @ (pulls @ root))
    return root, among, turn


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
    if support.patches:
        parts.append(
            f"At {support.patches} places along the edge of the picture it is carried as it is seen to go there."
        )
    if support.loose:
        past = ", and it slides past what lies beside it" if support.torn else ""
        parts.append(f"{support.loose:.0%} of what is seen goes along with the grip: nothing below holds that{past}.")
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
