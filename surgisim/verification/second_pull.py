"""Two manipulations of one body: parameters from the first, frozen, predict the second.

The paper's reviewers asked for it. The phantom's finite elements pull a block, let it go, and pull it elsewhere; noisy
tracks of the first manipulation are fitted with the right law, and the second is predicted without another look.

Error model: with the right law and no solver error, tracks and prediction differ by the tracks' own noise (the floor);
what is more comes from the parameters' uncertainty and from the difference between the two solvers.
"""

import numpy as np

from surgisim.verification.drawing import COLORS, panels
from surgisim.verification.manipulated.fit import fitted, tracked
from surgisim.verification.manipulated.scene import FPS, Scene, invent
from surgisim.verification.markdown import table

TITLE = "A second manipulation, predicted"

SEEDS, SPACING, EDGE = tuple(range(201, 209)), 5e-3, 2e-3
NOISE, BOUND = 3e-4, 1.5
"""Noise of each coordinate [m], that of the tracks tier; error over noise floor that is allowed."""


def measure(progress, quick: bool = False) -> dict:
    rows = []
    for done, seed in enumerate(SEEDS[:1] if quick else SEEDS):
        progress(done, len(SEEDS), f"seed {seed}")
        rows.append(predicted(invent(seed)))
    return {"noise": NOISE, "spacing": SPACING, "edge": EDGE, "bound": BOUND, "rows": rows}


def predicted(scene: Scene) -> dict:
    """RMS difference over frames of the second manipulation, in noise floors and [m]."""
    probes, first = scene.probes(), scene.holds[1].begin
    seen = tracked(scene, EDGE, probes, None, scene.frames)
    trial, solution = fitted(scene, SPACING, seen, None, first, noise=NOISE, seed=scene.seed)
    run = trial.run(solution.x, last=scene.frames - 1)
    observation = trial.observation
    simulated = np.stack([observation.carry @ u.astype(float) for u in run.u], 1)
    difference = simulated - observation.displacement
    over_time = np.sqrt((difference**2).mean((0, 2)))
    second = slice(first + 1, scene.frames)
    values = trial.wanted.values(solution.x)
    return {
        "seed": scene.seed,
        "fitted": float(np.sqrt((difference[:, 1 : first + 1] ** 2).mean())),
        "predicted": float(np.sqrt((difference[:, second] ** 2).mean())),
        "over_floor": float(np.sqrt((difference[:, second] ** 2).mean()) / NOISE),
        "still": float(np.sqrt((observation.displacement[:, second] ** 2).mean())),
        "values": values,
        "true": {"E": scene.law.E, "nu": scene.law.nu, "eta": scene.law.eta},
        "over_time": over_time,
        "begin": first,
    }


def draw(result: dict):
    figure, (left, right) = panels(2)
    for k, r in enumerate(result["rows"]):
        time = np.arange(len(r["over_time"])) / FPS
        left.plot(
            time, 1e3 * np.array(r["over_time"]), color=COLORS[k % len(COLORS)], linewidth=1, label=f"seed {r['seed']}"
        )
    left.axhline(1e3 * result["noise"], color="#1c2127", linewidth=0.8)
    left.axvline(result["rows"][0]["begin"] / FPS, color="#1c2127", linewidth=0.8, linestyle=":")
    left.set(xlabel="time [s]", ylabel="RMS difference [mm]", title="fitted | predicted")
    left.legend(frameon=False, fontsize=7)
    right.bar([str(r["seed"]) for r in result["rows"]], [r["over_floor"] for r in result["rows"]], color=COLORS[0])
    right.axhline(result["bound"], color="#1c2127", linewidth=0.8)
    right.set(xlabel="seed", ylabel="error / noise floor", title=TITLE)
    return figure


def words(result: dict) -> str:
    rows = [
        [
            r["seed"], f"{1e3 * r['fitted']:.3f}", f"{1e3 * r['predicted']:.3f}", f"{r['over_floor']:.2f}",
            f"{1e3 * r['still']:.2f}", "yes" if r["over_floor"] <= result["bound"] else "no",
        ]
        for r in result["rows"]
    ]  # fmt: skip
    return f"""
Noise floor {1e3 * result["noise"]:.1f} mm a coordinate. RMS difference per coordinate on the first manipulation
(fitted) and on the second (predicted, nothing fitted); "still" is what a body that does not move would get.

{table(["seed", "fitted [mm]", "predicted [mm]", "over the floor", "still [mm]", f"within {result['bound']}"], rows)}"""
