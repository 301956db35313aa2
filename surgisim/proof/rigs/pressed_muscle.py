"""Passive skeletal muscle pressed by 30 % at three rates and held for 300 s, along its fibres and across them.

The base is elastic, the same in all directions, and forgets nothing: it can neither relax nor tell the two directions
apart. Laws are added one at a time, the one that lowers the misfit most, and kept only if they lower the error on the
rate that was left out of the fit, for each of the three rates. Van Loocke, Lyons and Simms, Viscoelastic properties of
passive skeletal muscle in compression, J. Biomech. 41 (2008); read from the CANN repository's workbook (SOURCES.md).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from surgisim.artifacts.verdict import Effect, Verdict
from surgisim.physics.catalogue import Numbers, choose, defaults
from surgisim.problem import Problem
from surgisim.proof.known.catalogue import Answer, Found, Panel, curve
from surgisim.proof.rigs.pressed_cube import Pressed, stress
from surgisim.recordings.xls import read_xls

SHEETS = ("F_005", "F_01", "F_05", "XF_005", "XF_01", "XF_05")
"""Along (F) and across (XF) the fibres, each at three rates, 0.5, 1 and 5 % a second; the fibres lie along x."""
RATES = np.array([0, 1, 2, 0, 1, 2])
UNSEEN = 2
"""The rate that is shown, left out of the fit: the fastest, along the fibres, and three further across them."""
BASE = "neo_hookean"
CANDIDATES = ("relaxation", "relaxation_slow", "fibre", "stiffening", "newtonian", "damage", "plastic_set")
FIXED = {("neo_hookean", "nu"): 0.48, ("fibre", "yaw"): np.pi / 2, ("fibre", "pitch"): 0.0}
"""Muscle hardly changes its volume; the direction of the fibres is the testing laboratory's."""
START = {("neo_hookean", "E"): 1500.0, ("relaxation", "tau"): 2.0, ("relaxation_slow", "tau"): 80.0}
ROUNDS, EVALUATIONS = 5, 14


@dataclass(frozen=True)
class Fit:
    values: dict[str, Numbers]
    error: np.ndarray
    """RMS of each test over its own peak [1], (n,)."""


def tests(path: Path) -> tuple[Pressed, np.ndarray]:
    """The six tests, and the Cauchy stress that was measured [Pa], (6, S)."""
    book = read_xls(path)
    missing = [s for s in SHEETS if s not in book]
    if missing:
        raise Problem(f"{path}: lacks the sheets {missing}. Copy the workbook again.")
    tables = [book[s][1:, :3] for s in SHEETS]
    rows = min(len(t[np.isfinite(t).all(1)]) for t in tables)
    whole = np.stack([t[np.isfinite(t).all(1)][:rows] for t in tables])
    order = np.argsort(whole[..., 0], axis=1, kind="stable")
    whole = np.take_along_axis(whole, order[..., None], 1)
    axis = np.array([0, 0, 0, 1, 1, 1])
    return Pressed(whole[..., 0], whole[..., 2], axis), 1e3 * whole[..., 1]


def fit(laws: tuple[str, ...], begin: Mapping[str, Numbers], told: Pressed, seen: np.ndarray, use: np.ndarray) -> Fit:
    """Numbers of `laws` that suit the tests `use` (n,) bool, from `begin`; errors of all tests."""
    chosen = choose(laws)
    values = {n: begin.get(n, _start(n, t)) for n, t in chosen.items()}
    free = [(n, p) for n, t in chosen.items() for p in t.params if (n, p) not in FIXED]
    params = [chosen[n].params[p] for n, p in free]
    peak = np.abs(seen).max(1)
    some = Pressed(told.time[use], told.stretch[use], told.axis[use])

    def unpacked(x):
        new = {n: dict(v) for n, v in values.items()}
        for (n, p), q, number in zip(free, params, x, strict=True):
            new[n][p] = float(np.exp(number) if q.logarithmic else number)
        return new

    def residual(x):
        return ((stress(chosen, unpacked(x), some) - seen[use]) / peak[use][:, None]).ravel()

    bounds = np.array([[_searched(q, q.low), _searched(q, q.high)] for q in params]).T
    first = np.array([_searched(q, values[n][p]) for (n, p), q in zip(free, params, strict=True)])
    first = np.clip(first, bounds[0] + 1e-6, bounds[1] - 1e-6)
    found = least_squares(residual, first, bounds=bounds, diff_step=1e-4, max_nfev=EVALUATIONS, xtol=1e-4, ftol=1e-4)
    best = unpacked(found.x)
    off = (stress(chosen, best, told) - seen) / peak[:, None]
    return Fit(best, np.sqrt((off**2).mean(1)))


def left_out(laws: tuple[str, ...], begin: Mapping[str, Numbers], told: Pressed, seen: np.ndarray) -> np.ndarray:
    """Error on each rate when it is left out of the fit [1], (3,)."""
    errors = []
    for rate in range(3):
        found = fit(laws, begin, told, seen, rate != RATES)
        errors.append(np.sqrt((found.error[rate == RATES] ** 2).mean()))
    return np.array(errors)


def diagnose(path: Path, progress=lambda *_: None) -> Found:
    """Add laws to the elastic base for as long as they pay on a rate that was not fitted."""
    told, seen = tests(path)
    everything = np.ones(len(seen), bool)
    laws: tuple[str, ...] = (BASE,)
    now, errors = fit(laws, {}, told, seen, everything), left_out(laws, {}, told, seen)
    history = [{"law": BASE, "fitted": _rms(now.error), "left_out": errors.tolist()}]
    ranking = []
    for round_ in range(ROUNDS):
        tried = {}
        rest = [c for c in CANDIDATES if c not in laws]
        for i, name in enumerate(rest):
            progress(round_ + i / len(rest), ROUNDS, f"{' + '.join(laws)} + {name}")
            tried[name] = fit((*laws, name), now.values, told, seen, everything)
        order = sorted(tried, key=lambda n: _rms(tried[n].error))
        best = order[0]
        after = left_out((*laws, best), now.values, told, seen)
        ranking.append({n: _rms(tried[n].error) for n in order})
        if not (after < errors).all():
            history.append({"law": best, "fitted": _rms(tried[best].error), "left_out": after.tolist(), "kept": False})
            break
        laws, now, errors = (*laws, best), tried[best], after
        history.append({"law": best, "fitted": _rms(now.error), "left_out": errors.tolist(), "kept": True})
    return _found(laws, now, history, ranking, told, seen)


def panels(laws: tuple[str, ...], begin: Mapping[str, Numbers], told: Pressed, seen: np.ndarray) -> tuple[Panel, ...]:
    """Stress over time at the fastest rate, along the fibres and across, predicted from the other rates."""
    use = RATES != UNSEEN
    base, named = (
        stress(choose(names), fit(names, values, told, seen, use).values, told)
        for names, values in (((BASE,), {}), (laws, begin))
    )
    return tuple(
        Panel(
            f"the fastest rate, {way} the fibres, predicted from the other two",
            "time [s]",
            "pressure [kPa]",
            *(curve(told.time[test], -1e-3 * values[test]) for values in (seen, base, named)),
        )
        for test, way in ((UNSEEN, "along"), (UNSEEN + 3, "across"))
    )


def _found(laws, now: Fit, history, ranking, told: Pressed, seen: np.ndarray) -> Found:
    terms = choose(laws)
    added = laws[1:]
    effects = tuple(
        Effect(n, 1.0, parameters={p: {"value": v, "unit": terms[n].params[p].unit} for p, v in now.values[n].items()})
        for n in added
    )
    said = " and ".join(n.replace("_", " ") for n in added)
    words = (
        f"An elastic cube cannot do what the muscle does: {said} were left out. "
        f"They lower the error on a rate that was not fitted from {100 * _rms(history[0]['left_out']):.0f} to "
        f"{100 * _rms([h for h in history if h.get('kept', True)][-1]['left_out']):.0f} % of the peak stress."
    )
    ends = [f"{n}.{p}" for n in added for p, q in terms[n].params.items() if _at_an_end(q, n, p, now.values[n][p])]
    if ends:
        words += (
            f" At an end of the range that is searched, so that only the order of magnitude means something: {ends[0]}"
        )
        words += "".join(f", {e}" for e in ends[1:]) + "."
    verdict = Verdict("muscle", "named" if added else "nothing detectable", effects, (), None, (), {}, {}, None, words)
    physics = {
        "terms": {
            n: {p: {"value": v, "unit": terms[n].params[p].unit} for p, v in now.values[n].items()} for n in laws
        },
        "history": history,
        "ranking": ranking,
        "time": told.time.tolist(),
        "measured": seen.tolist(),
        "base": stress(choose((BASE,)), fit((BASE,), {}, told, seen, np.ones(len(seen), bool)).values, told).tolist(),
        "named": stress(terms, now.values, told).tolist(),
    }
    return Found(verdict, physics, panels(laws, now.values, told, seen))


def ask(folder: Path, found: Found) -> list[Answer]:
    got = " and ".join(found.verdict.names).replace("_", " ") or found.verdict.verdict
    relaxes = bool({"relaxation", "relaxation_slow"} & set(found.verdict.names))
    history = [h for h in found.physics["history"] if h.get("kept", True)]
    before, after = (_rms(h["left_out"]) for h in (history[0], history[-1]))
    return [
        Answer("relaxation", "named", got, relaxes),
        Answer("anisotropy", "named (fibre)", got, "fibre" in found.verdict.names),
        Answer(
            "error on the rate left out of the fit, over the peak stress",
            "lower than the base's, for each rate",
            f"{100 * before:.0f} % to {100 * after:.0f} %",
            bool((np.array(history[-1]["left_out"]) < history[0]["left_out"]).all()),
        ),
    ]


def _start(name: str, term) -> Numbers:
    """Where the fit begins: what is fixed, what is known of muscle, else the law's default."""
    own = {p: v for (n, p), v in {**START, **FIXED}.items() if n == name}
    return defaults(term) | own


def _searched(param, value: float) -> float:
    return float(np.log(max(value, param.low))) if param.logarithmic else float(value)


def _at_an_end(param, law: str, name: str, value: float) -> bool:
    if (law, name) in FIXED:
        return False
    low, high = _searched(param, param.low), _searched(param, param.high)
    return min(_searched(param, value) - low, high - _searched(param, value)) < 0.01 * (high - low)


def _rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
