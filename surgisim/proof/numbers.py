"""A named law's numbers against those it was concealed with, where both laws have the same number.

The phantom's effects and the engine's laws are not the same equations. COMPARED holds the numbers that mean the same
to first order in strain, with the factor between them; whatever is not there is not compared.
"""

import math
from collections.abc import Callable

from surgisim.artifacts.verdict import Effect
from surgisim.proof.naming import common

Values = dict[str, float]
Make = Callable[[Values, dict[str, float]], float]


def _mu(base: dict[str, float]) -> float:
    return base["E"] / (2 * (1 + base["nu"]))


COMPARED: dict[str, dict[str, Make]] = {
    "relaxation": {"G": lambda v, base: v["g"] * _mu(base), "tau": lambda v, base: v["tau"]},
    "fibre": {"k1": lambda v, base: v["k1"], "k2": lambda v, base: v["k2"]},
    "stiffening": {"k": lambda v, base: v["alpha"] * _mu(base)},
    "stiff_inclusion": {"s": lambda v, base: v["factor"]},
    "added_mass": {"mass": lambda v, base: v["mass"]},
    "hidden_contact": {"force": lambda v, base: v["force"]},
    "tether": {"stiffness": lambda v, base: v["k"], "slack": lambda v, base: v["slack"]},
    "respiration": {"amplitude": lambda v, base: v["amplitude"], "period": lambda v, base: 1 / v["frequency"]},
    "active_contraction": {"tension": lambda v, base: v["tension"], "period": lambda v, base: v["period"]},
    "damage": {"onset": lambda v, base: v["bears"]},
    # Half the angle of a sheared cube against von Mises' equivalent strain, angle / sqrt(3).
    "plastic_set": {"yield_strain": lambda v, base: 2 * v["yield_strain"] / math.sqrt(3)},
    "damping": {"eta": lambda v, base: v["eta"]},
}


def parameters(concealed: dict, effect: Effect, base: dict[str, float]) -> list[dict]:
    """Each comparable number: true, fitted, its interval, relative error, whether the interval holds the true one."""
    if common(effect.term) != concealed["term"]:
        return []
    told = {name: entry["value"] for name, entry in concealed["parameters"].items()}
    rows = []
    for name, make in COMPARED.get(concealed["term"], {}).items():
        given = effect.parameters.get(name)
        if given is None:
            continue
        # A generator whose law has a measure of its own says so, and nobody's number is held against it.
        if any(given_name.startswith("own ") for given_name in told):
            continue
        true = make(told, base)
        low, high = given.get("low"), given.get("high")
        rows.append(
            {
                "term": concealed["term"],
                "name": name,
                "unit": given.get("unit", "1"),
                "true": true,
                "value": given["value"],
                "low": low,
                "high": high,
                "relative": given["value"] / true - 1 if true else None,
                "covered": None if low is None or high is None else bool(low <= true <= high),
            }
        )
    return rows
