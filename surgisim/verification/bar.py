"""Axial and bending frequencies of a square bar against beam theory.

A bar ten times as long as thick, struck in its first mode so gently that it stays linear (strain 1e-3), no
viscosity. Axial: Love's rod, sqrt(E / rho) / (2 L) free and / (4 L) clamped at one end, with its small correction for
lateral inertia. Bending: Timoshenko's beam. See beam_theory.py.

Error model: free ends fall with the square of the spacing (nodal masses are lumped). At a clamp the anchors are
springs of rate k per unit of mass (grip.py; it rises with 1 / dx^2), which give way over a depth sqrt(E / (rho k)): the
bar acts as if it were longer by that, so the error there falls with the first power.
"""

import numpy as np

from surgisim.verification.beam_theory import Square, axial, axial_shape, bending_shape, euler, timoshenko
from surgisim.verification.drawing import COLORS, legend, panels, reference, slope
from surgisim.verification.markdown import table
from surgisim.verification.rod import CELLS, DENSITY, THICKNESS, block, rod, unmoved
from surgisim.verification.vibration import strike, vibration

TITLE = "Frequencies of a bar"

SLENDER, E, NU = 10.0, 3000.0, 0.45
STRAIN = 1e-3
ALL = (2, 3, 4, CELLS)
FULL = {("axial", "free", NU): ALL, ("bending", "free", NU): ALL, ("axial", "clamped", 0.0): ALL}
FULL |= {("bending", "clamped", 0.0): ALL, ("axial", "clamped", NU): (CELLS,), ("bending", "clamped", NU): (CELLS,)}
QUICK = {("axial", "free", NU): (2, 3), ("bending", "free", NU): (2, 3), ("axial", "clamped", 0.0): (2, 3)}


def measure(progress, quick: bool = False) -> dict:
    chosen = QUICK if quick else FULL
    plan = [(*which, cells) for which, several in chosen.items() for cells in several]
    rows = []
    for done, (kind, ends, nu, cells) in enumerate(plan):
        progress(done, len(plan), f"{kind}, {ends}, nu {nu}, {cells} cells over the thickness")
        rows.append(frequency(kind, ends, nu, cells))
    result = {"thickness": THICKNESS, "length": SLENDER * THICKNESS, "E": E, "density": DENSITY, "rows": rows}
    result["euler"] = {ends: euler(square(NU), ends) for ends in ("free", "clamped")}
    result["slopes"] = {}
    for which, several in chosen.items():
        mine = [r for r in rows if r["series"] == series(*which)]
        if len(several) > 1:
            result["slopes"][series(*which)] = slope([r["spacing"] for r in mine], [r["error"] for r in mine])
    return result


def series(kind: str, ends: str, nu: float) -> str:
    return f"{kind}, {ends}, nu {nu:g}"


def square(nu: float) -> Square:
    return Square(SLENDER * THICKNESS, THICKNESS, E, nu, DENSITY)


def frequency(kind: str, ends: str, nu: float, cells: int) -> dict:
    """Frequency [Hz] measured, after theory, and their relative difference."""
    bar, spacing = square(nu), THICKNESS / cells
    body = block((bar.length, bar.side, bar.side), spacing, spacing if ends == "clamped" else 0.0)
    laid = rod(body, {"corotated": {"E": E, "nu": nu}})
    if kind == "axial":
        theory, mode = axial(bar, ends), axial_shape(bar, ends, laid.nodes)
    else:
        theory, mode = timoshenko(bar, ends).frequency, bending_shape(bar, ends, laid.nodes)
    amplitude = STRAIN * (bar.length / 3 if kind == "axial" else bar.side)
    time, q, step = strike(laid, mode, theory, amplitude=amplitude, periods=1.5)
    found = vibration(time, q, 2 * np.pi * theory).frequency
    spring = laid.made.drive(unmoved(2), laid.values, fps=1 / step, per_frame=1).stiffness[0, 0, 0]
    longer = (E / (DENSITY * spring)) ** 0.5 / bar.length if ends == "clamped" else 0.0
    return {
        "series": series(kind, ends, nu),
        "cells": cells,
        "spacing": spacing,
        "particles": len(body.rest),
        "step": step,
        "theory": theory,
        "found": found,
        "error": found / theory - 1,
        "of_the_clamp": (1 + longer) ** (-1 if kind == "axial" else -2) - 1,
    }


def draw(result: dict):
    figure, (ax,) = panels(1)
    for color, name in zip(COLORS, dict.fromkeys(r["series"] for r in result["rows"]), strict=False):
        mine = [r for r in result["rows"] if r["series"] == name]
        x, y = [1000 * r["spacing"] for r in mine], [100 * abs(r["error"]) for r in mine]
        label = f"{name} (slope {result['slopes'][name]:.1f})" if name in result["slopes"] else name
        ax.loglog(x, y, "o-", color=color, label=label)
    x = [1000 * r["spacing"] for r in result["rows"]]
    reference(ax, x, 5.0, 2)
    ax.axhline(3, color="#1c2127", linewidth=0.8)
    ax.text(min(x), 3.1, "bound: 3 %", fontsize=8)
    ax.axvline(1000 * result["thickness"] / CELLS, color="#1c2127", linewidth=0.8, linestyle=":")
    ax.set(xlabel="grid spacing [mm]", ylabel="|frequency / beam theory - 1| [%]", title=TITLE)
    legend(ax, loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.set_size_inches(7.6, 3.8)
    return figure


def words(result: dict) -> str:
    rows = []
    for r in result["rows"]:
        clamp = f"{100 * r['of_the_clamp']:+.2f} %" if r["of_the_clamp"] else ""
        told = [r["series"], r["cells"], r["particles"], f"{r['theory']:.4f}", f"{r['found']:.4f}"]
        rows.append([*told, f"{100 * r['error']:+.2f} %", clamp])
    head = [
        "mode, ends",
        "cells over the thickness",
        "particles",
        "theory [Hz]",
        "found [Hz]",
        "error",
        "clamp's share",
    ]
    worst = {n: max(abs(r["error"]) for r in result["rows"] if r["cells"] == n) for n in sorted({3, rows[-1][1]})}
    bound = ", ".join(f"{100 * value:.1f} % at {n} cells" for n, value in worst.items())
    slopes = "; ".join(f"{name}: {value:.1f}" for name, value in result["slopes"].items())
    return f"""
A bar {1000 * result["length"]:.0f} mm long and {1000 * result["thickness"]:.0f} mm thick, E {result["E"]:.0f} Pa,
struck in its first mode. Axial: Love's rod; bending: Timoshenko's beam (Euler and Bernoulli's would be
{result["euler"]["free"]:.3f} Hz free and {result["euler"]["clamped"]:.4f} Hz clamped). The default resolution, here and
below, is what `thickening` makes of tissue: 8 particles a cell and about {CELLS} cells over the thickness (dotted).

{table(head, rows)}
Largest error: {bound}. Slopes of the error over the spacing: {slopes}.

Free ends converge with the square of the spacing. A clamp does not: it is made of springs on the held particles and
gives way over a sixth of a cell and less, so a bar held by it is longer by that; the last column is what that alone
does to the frequency. With nu 0 beam theory is exact at the clamp too; with nu 0.45 the clamp also
hinders the bar from bulging, which no beam theory knows and which stiffens it a little.
"""
