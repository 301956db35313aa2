"""A body that nothing holds falls along a parabola and stays as it is.

    u(t_n) = v0 t_n + g t_n (t_n + dt) / 2

Symplectic Euler moves with the velocity after the kick, which is half a step of fall ahead of g t^2 / 2; nothing else
may differ, at any step size and any place of the body. Hairer, Lubich and Wanner, Geometric Numerical Integration
(2006), section I.1.
"""

import numpy as np

from surgisim.verification.drawing import COLORS, legend, panels, reference, slope
from surgisim.verification.markdown import table
from surgisim.verification.rod import block, rod

TITLE = "Free fall"

GRAVITY, UP, TIME = 9.81, 0.5, 0.2
VALUES = {"corotated": {"E": 3000.0, "nu": 0.45}, "newtonian": {"eta": 1.0}}


def measure(progress, quick: bool = False) -> dict:
    rows = []
    plan = [(n, precision) for precision in ("single", "double") for n in ((1, 4) if quick else (1, 2, 4, 8))]
    for done, (refine, precision) in enumerate(plan):
        progress(done, len(plan), f"step / {refine}, {precision} precision")
        rows.append(fall(refine, precision))
    order = slope([r["step"] for r in rows], [r["off_parabola"] for r in rows])
    return {"g": GRAVITY, "up": UP, "rows": rows, "order": order}


def fall(refine: int, precision: str) -> dict:
    """A block thrown upwards along -y: distance [m] from both parabolas at the end, and how much it deforms."""
    laid = rod(block((0.024, 0.024, 0.018), 0.006), VALUES, gravity=(0.0, GRAVITY, 0.0), precision=precision)
    steps = round(TIME / laid.step) * refine
    step, samples = TIME / steps, 10
    every = steps // samples
    begin = np.zeros_like(laid.nodes)
    v = begin - [0.0, UP, 0.0]
    out = laid.run(step, every, samples, begin=(begin, v))
    u = out.u.astype(float)
    time = np.arange(samples + 1) * every * step
    parabola = -UP * time + GRAVITY * time**2 / 2
    shifted = parabola + GRAVITY * time * step / 2
    return {
        "step": step,
        "steps": every * samples,
        "precision": precision,
        "eps": float(np.finfo(out.u.dtype).eps / 2),
        "time": time,
        "middle": u[..., 1].mean(1),
        "off_parabola": np.abs(u[..., 1].mean(1) - parabola).max(),
        "off_shifted": np.abs(u - np.stack([0 * time, shifted, 0 * time], 1)[:, None]).max(),
        "deforms": np.abs(u - u.mean(1, keepdims=True)).max(),
    }


def draw(result: dict):
    figure, (left, right) = panels(2)
    row = result["rows"][0]
    left.plot(row["time"], 1000 * np.array(row["middle"]), "o", color=COLORS[0], label="measured")
    t = np.linspace(0, row["time"][-1], 100)
    left.plot(t, 1000 * (result["g"] * t**2 / 2 - result["up"] * t), color=COLORS[1], label="parabola")
    left.set(xlabel="time [s]", ylabel="fallen [mm]", title=TITLE)
    for color, precision in zip(COLORS, ("single", "double"), strict=False):
        rows = [r for r in result["rows"] if r["precision"] == precision]
        steps = [1000 * r["step"] for r in rows]
        if precision == "single":
            off = [1000 * r["off_parabola"] for r in rows]
            right.loglog(steps, off, "s-", color=COLORS[2], label=f"g t^2 / 2 (slope {result['order']:.2f})")
            reference(right, steps, 2 * max(off), 1)
        shifted = [1000 * r["off_shifted"] for r in rows]
        right.loglog(steps, shifted, "o-", color=color, label=f"g t (t + dt) / 2, {precision}")
    right.set(xlabel="step [ms]", ylabel="largest distance [mm]", title="from the parabola")
    legend(left)
    legend(right)
    return figure


def words(result: dict) -> str:
    rows = [
        [
            r["precision"],
            f"{1e3 * r['step']:.3f}",
            r["steps"],
            *(f"{1e6 * r[k]:.2e}" for k in ("off_parabola", "off_shifted", "deforms")),
        ]
        for r in result["rows"]
    ]
    head = [
        "precision",
        "step [ms]",
        "steps",
        "from g t²/2 [um]",
        "from g t (t + dt)/2, any node [um]",
        "deformation [um]",
    ]
    return f"""
A block thrown upwards at {result["up"]} m/s falls for {result["rows"][0]["time"][-1]:.1f} s. Symplectic Euler is half a
step of fall ahead of the parabola (slope over the step {result["order"]:.2f}, 1 expected); beside that only rounding is
left, and the body keeps its shape.

{table(head, rows)}"""
