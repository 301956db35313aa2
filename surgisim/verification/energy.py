"""Total energy: kept without viscosity, never growing with it.

A free block is set in violent motion (strains of some ten per cent). Energy at a displacement's own time: the laws'
stored energy, and the product of the velocities half a step before and after (see energies.py). Double precision.

Error model: symplectic Euler keeps a modified energy, so without viscosity the energy swings by a share of (omega dt)^2
about a constant and does not drift. Hairer, Lubich and Wanner, Geometric Numerical Integration (2006), theorem IX.8.1.
With viscosity it falls from step to step.
"""

import numpy as np

from surgisim.verification.conservation import SIZE, SPACING, flight
from surgisim.verification.drawing import COLORS, legend, panels, reference, slope
from surgisim.verification.energies import kinetic, stored
from surgisim.verification.markdown import table
from surgisim.verification.rod import block, rod

TITLE = "Energy"

ELASTIC = {"E": 3000.0, "nu": 0.45}
FULL = {
    "corotated": {"corotated": ELASTIC},
    "neo_hookean": {"neo_hookean": ELASTIC},
    "corotated + newtonian": {"corotated": ELASTIC, "newtonian": {"eta": 0.3}},
    "neo_hookean + paper_viscous": {"neo_hookean": ELASTIC, "paper_viscous": {"eta": 0.3, "gamma": 1.0}},
}
QUICK = ("corotated", "corotated + newtonian")


def measure(progress, quick: bool = False) -> dict:
    several, duration = ((1, 2, 4), 0.15) if quick else ((1, 2, 4, 8), 0.6)
    chosen = {name: FULL[name] for name in QUICK} if quick else FULL
    rows = []
    for done, (name, values) in enumerate(chosen.items()):
        progress(done, len(chosen), name)
        runs = [motion(values, refine, duration) for refine in several]
        steps = [r["step"] for r in runs]
        row = {"laws": name, "dissipative": len(values) > 1, "runs": runs}
        row["order"] = None if row["dissipative"] else slope(steps, [r["growth"] for r in runs])
        rows.append(row)
    return {"duration": duration, "laws": rows}


def motion(values: dict, refine: int, duration: float) -> dict:
    """Energy of one free motion, relative to its first: curve, growth above its lowest so far, drift [1/s]."""
    laid = rod(block(SIZE, 2 * SPACING), values, precision="double")
    step = laid.step / refine
    steps = int(duration / step)
    out = laid.run(step, 1, steps, begin=(np.zeros_like(laid.nodes), flight(laid)))
    energy = kinetic(laid, out.v[:-1], out.v[1:]) + stored(laid, out.u[:-1])
    # What flies and spins on for ever is no measure of what vibrates.
    moving = kinetic(laid, np.broadcast_to(out.v[-1:].mean(1, keepdims=True), out.v[-1:].shape))[0]
    energy = (energy - moving) / (energy[0] - moving)
    time = np.arange(steps) * step
    line = np.polyfit(time, energy, 1)
    thin = max(1, steps // 200)
    return {
        "step": step,
        "growth": float((energy - np.minimum.accumulate(energy)).max()),
        "drift": float(line[0]),
        "lost": float(1 - energy[-1]),
        "time": time[::thin],
        "energy": energy[::thin],
    }


def draw(result: dict):
    figure, (left, right) = panels(2)
    for color, row in zip(COLORS, result["laws"], strict=False):
        coarse = row["runs"][0]
        left.plot(coarse["time"], coarse["energy"], color=color, linewidth=1, label=row["laws"])
        if not row["dissipative"]:
            x, y = [1000 * r["step"] for r in row["runs"]], [r["growth"] for r in row["runs"]]
            right.loglog(x, y, "o-", color=color, label=f"{row['laws']} (slope {row['order']:.1f})")
    reference(right, x, 2 * max(y), 2)
    left.set(xlabel="time [s]", ylabel="energy / first", title="at the default step", ylim=(0, None))
    right.set(xlabel="step [ms]", ylabel="growth / first energy", title="swing without viscosity")
    legend(left)
    legend(right)
    return figure


def words(result: dict) -> str:
    rows = []
    for row in result["laws"]:
        for r in row["runs"]:
            told = [row["laws"], f"{1000 * r['step']:.3f}", f"{r['growth']:.1e}"]
            rows.append([*told, "" if row["dissipative"] else f"{r['drift']:+.1e}", f"{100 * r['lost']:.2f} %"])
    orders = "; ".join(f"{row['laws']} {row['order']:.1f}" for row in result["laws"] if row["order"])
    head = ["laws", "step [ms]", "largest growth above the lowest so far", "trend [1/s]", "lost at the end"]
    return f"""
A block that nothing holds, in violent motion (strains of some ten per cent) for {result["duration"]} s. Energies are
shares of what is not flight at the start. Without viscosity the energy swings by a share that falls with the step
(slopes: {orders}; 2 expected) and does not drift; with viscosity it only falls.

{table(head, rows)}"""
