"""Numerical damping: how fast a vibration without viscosity dies, at the default step and at smaller ones.

A rod of tissue vibrates freely in its first axial mode for a second or more, eta = 0. Its decay is fitted to the mode's
amplitude, and to the energy of the whole body (centred in time, so that it does not swing at first order).

Error model: symplectic Euler turns every linear mode without growth or decay, and no transfer smooths the velocities,
since they stay on the nodes: no damping at any step, up to rounding. The affine particle-in-cell transfer in comparison
damps with every step (0.12 to 1.18 per second with 20 to 400 steps a frame at E / rho = 25 m^2/s^2 and 25 fps).
"""

import numpy as np

from surgisim.verification.beam_theory import Square, axial, axial_shape
from surgisim.verification.drawing import COLORS, legend, panels
from surgisim.verification.energies import kinetic, stored
from surgisim.verification.markdown import table
from surgisim.verification.rod import CELLS, DENSITY, THICKNESS, block, rod
from surgisim.verification.vibration import SAMPLES, vibration

TITLE = "Numerical damping"

SLENDER, E, NU = 8.0, 3000.0, 0.45
STRAIN, BOUND = 1e-2, 0.1
FULL = ((3, 1), (3, 4), (3, 16), (CELLS, 1), (CELLS, 4))
"""Cells over the thickness, and by what the default step is divided."""
QUICK = ((2, 1), (2, 4))


def measure(progress, quick: bool = False) -> dict:
    plan = QUICK if quick else FULL
    rows = []
    for done, (cells, refine) in enumerate(plan):
        progress(done, len(plan), f"{cells} cells over the thickness, step / {refine}")
        rows.append(dying(cells, refine, 1.0))
    forms = []
    for form in ("total", "updated"):
        for refine in (1, 4) if quick else (1, 4, 16):
            progress(len(plan), len(plan), f"hung up, {form} form, step / {refine}")
            forms.append(hung(form, refine))
    return {"bound": BOUND, "E": E, "nu": NU, "strain": STRAIN, "rows": rows, "forms": forms}


def dying(cells: int, refine: int, duration: float) -> dict:
    """Decay [1/s] of a mode's amplitude and of half the logarithm of the energy."""
    bar = Square(SLENDER * THICKNESS, THICKNESS, E, NU, DENSITY)
    laid = rod(block((bar.length, bar.side, bar.side), THICKNESS / cells), {"corotated": {"E": E, "nu": NU}})
    mode, frequency = axial_shape(bar, "free", laid.nodes), axial(bar, "free")
    step = laid.step / refine
    every = max(1, int(1 / (frequency * SAMPLES * step)))
    samples = int(np.ceil(duration / (every * step)))
    speed = STRAIN * bar.length / np.pi * 2 * np.pi * frequency * mode
    out = laid.run(step, every, samples, begin=(np.zeros_like(speed), speed))
    time = np.arange(samples + 1) * every * step
    weight = laid.mass[:, None] * mode
    q = np.einsum("tna,na->t", out.u.astype(float), weight) / np.sum(weight * mode)
    found = vibration(time, q, 2 * np.pi * frequency)
    energy = kinetic(laid, out.v) + stored(laid, out.u)
    basis = np.stack([np.ones_like(time), time], 1)
    trend = np.linalg.lstsq(basis, np.log(energy / energy[0]), rcond=None)[0][1]
    return {
        "cells": cells,
        "refine": refine,
        "step": step,
        "steps": samples * every,
        "frequency": found.frequency,
        "decay": found.decay,
        "energy_decay": -trend / 2,
        "rest": found.rest,
        "time": time,
        "energy": energy / energy[0],
    }


def hung(form: str, refine: int) -> dict:
    """Decay [1/s] of a rod that hangs from its end and swings along its length about its sag, for either form.

    The updated form starts from rest only: what sets the rod going is gravity, switched on at the start.
    """
    spacing, length = THICKNESS / 3, 4 * THICKNESS
    values = {"corotated": {"E": E, "nu": NU}}
    laid = rod(block((length, THICKNESS, THICKNESS), spacing, spacing), values, gravity=(0.5, 0.0, 0.0), form=form)
    frequency, step = axial(Square(length, THICKNESS, E, NU, DENSITY), "clamped"), laid.step / refine
    every = max(1, int(1 / (frequency * SAMPLES * step)))
    samples = int(np.ceil(0.6 / (every * step)))
    out = laid.run(step, every, samples)
    tip = laid.made.simulator.carry(np.array([[length, 0.0, 0.0]])) @ out.u[..., 0].astype(float).T
    time = np.arange(samples + 1) * every * step
    found = vibration(time, tip[0], 2 * np.pi * frequency, about=True)
    return {"form": form, "refine": refine, "step": step, "frequency": found.frequency, "decay": found.decay,
            "time": time, "tip": tip[0]}  # fmt: skip


def draw(result: dict):
    figure, (left, middle, right) = panels(3)
    for color, r in zip(COLORS, result["rows"], strict=False):
        label = f"{r['cells']} cells, step {1e3 * r['step']:.3f} ms"
        left.plot(r["time"], 100 * (np.array(r["energy"]) - 1), color=color, linewidth=1, label=label)
    left.set(xlabel="time [s]", ylabel="energy / first - 1 [%]", title="energy of a free rod, eta = 0")
    for color, r in zip(COLORS[:0:-1] + COLORS, result["forms"], strict=False):
        middle.plot(
            r["time"], 1000 * np.array(r["tip"]), color=color, linewidth=1, label=f"{r['form']}, step / {r['refine']}"
        )
    middle.set(xlabel="time [s]", ylabel="end [mm]", title="a rod that hangs, eta = 0")
    for color, what in zip(COLORS, ("decay", "energy_decay"), strict=False):
        label = "free, of the amplitude" if what == "decay" else "free, of the energy"
        for marker, cells in zip("os^", dict.fromkeys(r["cells"] for r in result["rows"]), strict=False):
            mine = [r for r in result["rows"] if r["cells"] == cells]
            x, y = [1000 * r["step"] for r in mine], [abs(r[what]) for r in mine]
            right.loglog(x, y, f"{marker}-", color=color, label=f"{label}, {cells} cells")
    for color, form in zip(COLORS[2:], ("total", "updated"), strict=False):
        mine = [r for r in result["forms"] if r["form"] == form]
        x, y = [1000 * r["step"] for r in mine], [abs(r["decay"]) for r in mine]
        right.loglog(x, y, "d-", color=color, label=f"hanging, {form} form")
    right.axhline(result["bound"], color="#1c2127", linewidth=0.8)
    right.text(min(r["step"] for r in result["rows"]) * 1000, 1.1 * result["bound"], "bound", fontsize=8)
    right.set(xlabel="step [ms]", ylabel="|decay| [1/s]", title=TITLE)
    for ax in (left, middle, right):
        legend(ax)
    return figure


def words(result: dict) -> str:
    rows = []
    for r in result["rows"]:
        told = [r["cells"], f"{r['refine']}", f"{1000 * r['step']:.4f}", r["steps"], f"{r['frequency']:.3f}"]
        rows.append([*told, f"{r['decay']:+.1e}", f"{r['energy_decay']:+.1e}"])
    forms = [
        [r["form"], r["refine"], f"{1000 * r['step']:.4f}", f"{r['frequency']:.3f}", f"{r['decay']:+.1e}"]
        for r in result["forms"]
    ]
    head = ["cells over the thickness", "default step over", "step [ms]", "steps", "frequency [Hz]"]
    return f"""
A rod of tissue (E {result["E"]:.0f} Pa, nu {result["nu"]}) vibrates freely along its length for a second, strain
{result["strain"]:g}, without viscosity. Bound: {result["bound"]} per second. Minus is growth; what is left is the fit's
own noise (a few other, weak modes) and rounding.

{table([*head, "decay of the amplitude [1/s]", "decay of the energy [1/s]"], rows)}
A rod that hangs from its end and swings about its sag, in the total form (the default) and in the updated one (the
paper's, with its affine particle-in-cell transfer):

{table(["form", *head[1:3], "frequency [Hz]", "decay [1/s]"], forms)}"""
