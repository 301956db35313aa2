"""Decay of a rod with Kelvin-Voigt viscosity against the closed form.

sigma = 2 eta D beside elasticity turns mu into mu + eta s for a motion exp(s t) and leaves lambda alone. A thin rod's
modulus E = mu (3 lambda + 2 mu) / (lambda + mu) then has the slope dE/dmu = 2 (1 + 2 nu^2), which is also what
2 eta D : D dissipates when the rod bulges by -nu:

    eta_axial = 2 eta (1 + 2 nu^2),   decay = eta_axial omega^2 / (2 E) = zeta omega,   zeta = eta_axial omega / (2 E)

for axial and for bending modes alike (in bending every fibre is in uniaxial tension). The logarithmic decrement is
2 pi zeta / sqrt(1 - zeta^2). Christensen, Theory of Viscoelasticity (1982), chapter 2 (correspondence principle).

Error model: viscosity is explicit, so one mode decays by the factor 1 - 2 decay dt a step in energy instead of
exp(-2 decay dt), which is decay (1 + decay dt): first order in the step; and the frequency's own error of the grid.
"""

import numpy as np

from surgisim.verification.beam_theory import Square, axial, axial_shape, bending_shape, timoshenko
from surgisim.verification.drawing import COLORS, legend, panels
from surgisim.verification.markdown import table
from surgisim.verification.rod import DENSITY, THICKNESS, block, rod
from surgisim.verification.vibration import strike, vibration

TITLE = "Decay of a viscous rod"

SLENDER, E = 10.0, 3000.0
FULL = [("axial", nu, zeta, cells) for nu in (0.0, 0.3, 0.45) for zeta in (0.02, 0.1) for cells in (2, 3)]
FULL += [("axial", 0.45, 0.1, 4), ("bending", 0.45, 0.05, 2), ("bending", 0.45, 0.05, 3), ("bending", 0.45, 0.05, 4)]
QUICK = [("axial", 0.0, 0.1, 2), ("axial", 0.45, 0.1, 2), ("axial", 0.45, 0.1, 3)]


def measure(progress, quick: bool = False) -> dict:
    plan = QUICK if quick else FULL
    rows = []
    for done, (kind, nu, zeta, cells) in enumerate(plan):
        progress(done, len(plan), f"{kind}, nu {nu}, zeta {zeta}, {cells} cells over the thickness")
        rows.append(decay(kind, nu, zeta, cells))
    return {"length": SLENDER * THICKNESS, "thickness": THICKNESS, "E": E, "rows": rows}


def decay(kind: str, nu: float, zeta: float, cells: int) -> dict:
    """Decay [1/s] of the first mode of a free rod, measured and after the closed form."""
    bar = Square(SLENDER * THICKNESS, THICKNESS, E, nu, DENSITY)
    theory = axial(bar, "free") if kind == "axial" else timoshenko(bar, "free").frequency
    omega = 2 * np.pi * theory
    eta = zeta * E / (omega * (1 + 2 * nu**2))
    body = block((bar.length, bar.side, bar.side), THICKNESS / cells)
    laid = rod(body, {"corotated": {"E": E, "nu": nu}, "newtonian": {"eta": eta}})
    shape = (axial_shape if kind == "axial" else bending_shape)(bar, "free", laid.nodes)
    amplitude = 1e-3 * (bar.length / 3 if kind == "axial" else bar.side)
    time, q, step = strike(laid, shape, theory, amplitude=amplitude, periods=2.0)
    found = vibration(time, q, omega * np.sqrt(1 - zeta**2))
    wanted = zeta * omega
    stepped = -np.log(1 - 2 * wanted * step) / (2 * step)
    return {
        "kind": kind,
        "nu": nu,
        "zeta": zeta,
        "cells": cells,
        "eta": eta,
        "eta_axial": 2 * eta * (1 + 2 * nu**2),
        "step": step,
        "wanted": wanted,
        "found": found.decay,
        "error": found.decay / wanted - 1,
        "of_the_step": stepped / wanted - 1,
        "of_the_grid": (found.omega**2 + found.decay**2) / omega**2 - 1,
        "decrement_wanted": 2 * np.pi * zeta / np.sqrt(1 - zeta**2),
        "decrement": found.decrement,
        "time": time,
        "q": q / found.amplitude,
        "omega": found.omega,
    }


def draw(result: dict):
    figure, (left, right) = panels(2)
    row = max((r for r in result["rows"] if r["kind"] == "axial"), key=lambda r: (r["nu"], r["zeta"], r["cells"]))
    t = np.array(row["time"])
    left.plot(t, row["q"], "o", markersize=2.5, color=COLORS[0], label=f"rod, nu {row['nu']}, zeta {row['zeta']}")
    for sign in (1, -1):
        left.plot(t, sign * np.exp(-row["wanted"] * t), color=COLORS[1], label="closed form" if sign > 0 else None)
    left.set(xlabel="time [s]", ylabel="share of the mode", title=TITLE)
    kinds = sorted({(r["kind"], r["nu"]) for r in result["rows"]})
    for color, (kind, nu) in zip(COLORS, kinds, strict=False):
        mine = [r for r in result["rows"] if (r["kind"], r["nu"]) == (kind, nu)]
        x, y = [100 * (r["of_the_step"] + r["of_the_grid"]) for r in mine], [100 * r["error"] for r in mine]
        right.plot(x, y, "o", color=color, label=f"{kind}, nu {nu:g}", alpha=0.8)
    right.axline((0, 0), slope=1, color="#1c2127", linewidth=0.8)
    right.set(xlabel="explained by step and grid [%]", ylabel="decay / closed form - 1 [%]", title="all rods")
    legend(left)
    legend(right)
    return figure


def words(result: dict) -> str:
    rows = []
    for r in result["rows"]:
        told = [r["kind"], r["nu"], r["zeta"], r["cells"], r["eta"], r["eta_axial"], f"{r['wanted']:.4f}"]
        told += [
            f"{r['found']:.4f}",
            f"{100 * r['error']:+.2f} %",
            f"{100 * r['of_the_step']:+.2f} %",
            f"{100 * r['of_the_grid']:+.2f} %",
        ]
        rows.append([*told, f"{r['decrement']:.4f} / {r['decrement_wanted']:.4f}"])
    head = [
        "mode",
        "nu",
        "zeta",
        "cells",
        "eta [Pa s]",
        "eta axial [Pa s]",
        "closed form [1/s]",
        "found [1/s]",
        "error",
    ]
    return f"""
A free rod {1000 * result["length"]:.0f} mm long and {1000 * result["thickness"]:.0f} mm thick, corotated + newtonian,
struck in its first mode. The law's 2 eta D makes an axial viscosity 2 eta (1 + 2 nu²) (derived in the file); the mode
decays at eta_axial omega² / (2 E) = zeta omega.

{table([*head, "of the step", "of the grid", "decrement, found / closed form"], rows)}
Of the step: what explicit viscosity alone does to one mode, decay (1 + decay dt). Of the grid: what the frequency's own
error does to the decay through omega² (see the bar).
"""
