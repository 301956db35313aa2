"""What no step may change: mass, momentum, and angular momentum about the origin.

A block that nothing holds flies, spins and shakes (strains of some ten per cent) with an elastic and a viscous law.
Forces on the nodes sum to zero because the weights' gradients do, their moments because the stress is symmetric and
weights reproduce linear fields; symplectic Euler keeps both to the last digit of the arithmetic.

Error model: rounding. n steps in floating point of unit eps drift by eps sqrt(n) times the sum of the parts' sizes
where roundings are independent, by eps n at worst. Simo and Tarnow, The discrete energy-momentum method, 1992.
"""

import numpy as np

from surgisim.verification.drawing import COLORS, legend, panels
from surgisim.verification.markdown import table
from surgisim.verification.rod import DENSITY, Rod, block, rod

TITLE = "Mass and momentum"

SPACING, SIZE = 0.0045, (0.036, 0.027, 0.018)
SPIN, FLIGHT, SHAKE = 6.0, 0.2, 0.2
"""Turning [rad/s], speed of the whole [m/s], and speed of the shaking [m/s]."""
ELASTIC = {"E": 3000.0, "nu": 0.45}
LAWS = {
    "corotated": {"corotated": ELASTIC},
    "corotated + newtonian": {"corotated": ELASTIC, "newtonian": {"eta": 1.0}},
    "neo_hookean + paper_viscous": {"neo_hookean": ELASTIC, "paper_viscous": {"eta": 1.0, "gamma": 1.0}},
}


def measure(progress, quick: bool = False) -> dict:
    steps = 200 if quick else 6400
    rows, plan = [], [(name, precision) for precision in ("single", "double") for name in LAWS]
    for done, (name, precision) in enumerate(plan[:4] if quick else plan):
        progress(done, len(plan), f"{name}, {precision} precision")
        rows.append({"laws": name, "precision": precision, **drift(LAWS[name], steps, precision)})
    return {"steps": steps, "laws": rows}


def drift(values: dict, steps: int, precision: str) -> dict:
    """Relative change of mass, momentum and angular momentum along `steps` steps of a free flight."""
    laid = rod(block(SIZE, SPACING), values, precision=precision)
    every = max(1, steps // 40)
    out = laid.run(laid.step / 2, every, steps // every, begin=(np.zeros_like(laid.nodes), flight(laid)))
    x = laid.nodes + out.u.astype(float)
    momentum = laid.mass[:, None] * out.v.astype(float)
    linear, angular = momentum.sum(1), np.cross(x, momentum).sum(1)
    size = np.linalg.norm(momentum, axis=-1)
    mass = float(np.sum(laid.made.body.volume.astype(float)) * DENSITY)
    eps = float(np.finfo(out.u.dtype).eps / 2)
    return {
        "eps": eps,
        "mass": abs(laid.mass.sum() / mass - 1),
        "step": [n * every for n in range(len(linear))],
        "momentum": np.linalg.norm(linear - linear[0], axis=1) / size[0].sum(),
        "angular": np.linalg.norm(angular - angular[0], axis=1) / (size * np.linalg.norm(x, axis=-1))[0].sum(),
    }


def flight(laid: Rod) -> np.ndarray:
    """Velocity of the nodes at the start [m/s], (A, 3): flight, spin and a smooth shake."""
    x = laid.nodes - laid.nodes.mean(0)
    shake = np.stack([np.sin(90 * x[:, 1] + 60 * x[:, 2]), np.cos(80 * x[:, 0]), np.sin(70 * x[:, 0] - 1)], 1)
    return np.cross([0.3 * SPIN, -0.5 * SPIN, SPIN], x) + FLIGHT * np.array([1.0, 0.5, -0.7]) + SHAKE * shake


def draw(result: dict):
    figure, axes = panels(2)
    for ax, what, title in zip(axes, ("momentum", "angular"), ("momentum", "angular momentum"), strict=True):
        for color, row in zip(COLORS, result["laws"], strict=False):
            label = f"{row['laws']}, {row['precision']}"
            ax.loglog(row["step"][1:], row[what][1:], "o-", markersize=3, color=color, label=label)
        n = np.array(row["step"][1:], float)
        for eps in sorted({row["eps"] for row in result["laws"]}):
            ax.loglog(n, eps * np.sqrt(n), "--", color="#5d6773", linewidth=1, label=f"{eps:.0e} sqrt(n)")
        ax.set(xlabel="steps n", ylabel="relative change", title=title, ylim=(1e-18, 1e-4))
    for ax in axes:
        legend(ax, loc="center left")
    return figure


def words(result: dict) -> str:
    rows = []
    for r in result["laws"]:
        told = [r["laws"], r["precision"], f"{r['mass']:.1e}", f"{max(r['momentum']):.1e}", f"{max(r['angular']):.1e}"]
        rows.append([*told, f"{r['eps'] * result['steps'] ** 0.5:.1e}"])
    head = ["laws", "precision", "mass", "momentum", "angular momentum", "eps sqrt(n)"]
    return f"""
A block that flies, spins and shakes with nothing holding it, {result["steps"]} steps. Changes are relative to the sum
of the parts' sizes; rounding makes about eps sqrt(n) of them.

{table(head, rows)}"""
