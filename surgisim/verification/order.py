"""Order of accuracy under refinement of the step and of the grid.

Step: a block stretched by a tenth and let go without viscosity, compared with the same run at an eighth of the
finest step. Symplectic Euler's velocity belongs half a step before its displacement: started as if both belonged to
the same time it is of first order; started with v - dt a / 2 it is the leapfrog, of second order.

Grid: the first axial vibration of a free rod with nu = 0, whose closed form is the plane wave

    u = U cos(pi x / L) sin(pi c t / L),   c = sqrt(E / rho)

The displacement of the particles after a quarter of a period is compared in the root mean square. Quadratic splines
with lumped nodal masses: second order. The step is refined with the grid. Double precision.
"""

import numpy as np

from surgisim.verification.beam_theory import Square, axial, axial_shape
from surgisim.verification.drawing import COLORS, legend, panels, reference, slope
from surgisim.verification.markdown import table
from surgisim.verification.rod import DENSITY, THICKNESS, block, rod

TITLE = "Order of accuracy"

E = 3000.0
STRETCH, SPACING = 0.1, 0.006


def measure(progress, quick: bool = False) -> dict:
    progress(0, 2, "step")
    step = refined_step((2, 4, 8) if quick else (2, 4, 8, 16))
    progress(1, 2, "grid")
    grid = refined_grid((2, 3, 4) if quick else (2, 3, 4, 6, 8))
    return {"stretch": STRETCH, "step": step, "grid": grid}


def refined_step(several: tuple[int, ...]) -> dict:
    """Error of the displacement relative to the largest, of both ways to start, and their slopes."""
    laid = rod(block((0.036, 0.018, 0.018), SPACING), {"corotated": {"E": E, "nu": 0.3}}, precision="double")
    u0 = STRETCH * (laid.nodes - laid.nodes.mean(0)) * [1.0, -0.3, -0.3]
    rest = np.zeros_like(u0)
    coarse, time = laid.step, 40 * laid.step
    # The acceleration at the start, from one step.
    one = laid.run(coarse / 64, 1, 1, begin=(u0, rest)).v[1].astype(float) / (coarse / 64)

    def end(step, shift):
        steps = round(time / step)
        return laid.run(step, steps, 1, begin=(u0, rest - shift * step / 2 * one)).u[-1].astype(float)

    finest = coarse / (8 * max(several))
    truth = end(finest, 1.0)
    size = np.sqrt(np.mean((truth - u0) ** 2))
    rows = [
        {"step": coarse / r, **{n: _rms(end(coarse / r, s) - truth) / size for n, s in (("plain", 0), ("shifted", 1))}}
        for r in several
    ]
    steps = [r["step"] for r in rows]
    return {"rows": rows, "orders": {n: slope(steps, [r[n] for r in rows]) for n in ("plain", "shifted")}}


def refined_grid(several: tuple[int, ...]) -> dict:
    """Error of the particles' displacement against the plane wave, relative to its root mean square, and its slope."""
    bar = Square(4 * THICKNESS, THICKNESS, E, 0.0, DENSITY)
    frequency, rows = axial(bar, "free"), []
    for cells in several:
        # Two cells across are enough for a plane wave.
        spacing = THICKNESS / cells
        body = block((bar.length, 2 * spacing, 2 * spacing), spacing)
        laid = rod(body, {"corotated": {"E": E, "nu": 0.0}}, precision="double")
        omega, amplitude = 2 * np.pi * frequency, 1e-3 * bar.length
        steps = int(np.ceil(0.25 / frequency / (laid.step / 2)))
        step = 0.25 / frequency / steps
        v = omega * amplitude * axial_shape(bar, "free", laid.nodes)
        out = laid.run(step, steps, 1, begin=(np.zeros_like(v), v))
        moved = laid.made.simulator.carry(body.rest.astype(float)) @ out.u[-1].astype(float)
        wave = amplitude * axial_shape(bar, "free", body.rest.astype(float))
        rows.append({"spacing": spacing, "particles": len(body.rest), "error": _rms(moved - wave) / _rms(wave)})
    return {"rows": rows, "order": slope([r["spacing"] for r in rows], [r["error"] for r in rows])}


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))


def draw(result: dict):
    figure, (left, right) = panels(2)
    rows = result["step"]["rows"]
    x = [1000 * r["step"] for r in rows]
    for color, name in zip(COLORS, ("plain", "shifted"), strict=False):
        label = "as it is" if name == "plain" else "started with v - dt a / 2"
        y = [r[name] for r in rows]
        left.loglog(x, y, "o-", color=color, label=f"{label} (slope {result['step']['orders'][name]:.2f})")
        reference(left, x, 1.5 * max(y), 1 if name == "plain" else 2)
    left.set(xlabel="step [ms]", ylabel="relative error of u", title="step")
    x, y = [1000 * r["spacing"] for r in result["grid"]["rows"]], [r["error"] for r in result["grid"]["rows"]]
    right.loglog(x, y, "o-", color=COLORS[0], label=f"plane wave (slope {result['grid']['order']:.2f})")
    reference(right, x, 1.5 * max(y), 2)
    right.set(xlabel="spacing [mm]", ylabel="relative error of u", title="grid")
    legend(left)
    legend(right)
    return figure


def words(result: dict) -> str:
    step, grid = result["step"], result["grid"]
    steps = [[f"{1000 * r['step']:.4f}", f"{r['plain']:.2e}", f"{r['shifted']:.2e}"] for r in step["rows"]]
    grids = [[f"{1000 * r['spacing']:.3f}", r["particles"], f"{r['error']:.2e}"] for r in grid["rows"]]
    return f"""
Step: a block stretched by {result["stretch"]:g} and let go without viscosity, against a run with much finer steps. As
it is: slope {step["orders"]["plain"]:.2f} (1 expected); started with the velocity of half a step earlier, where
symplectic Euler's velocities belong: {step["orders"]["shifted"]:.2f} (2 expected). A body that starts at rest and
undeformed, as every clip does, has no such shift to begin with.

{table(["step [ms]", "error as it is", "error started half a step earlier"], steps)}
Grid: a plane wave along a free rod (nu 0), closed form, root mean square over the particles: slope {grid["order"]:.2f}
(2 expected).

{table(["spacing [mm]", "particles", "error"], grids)}"""
