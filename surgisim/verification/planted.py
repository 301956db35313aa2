"""Parameters planted in another solver and found from its tracks: two regions, one pull, its hold and release.

Eight blocks (as in `manipulation`) are pulled by the phantom's finite elements; beyond an upright plane between the two
grips the tissue is 1.5-3 times stiffer. Tracks of the upper side, with noise, go into the same search that a clip's go
into: E, nu, eta and the ratio of the regions (the plane is given). What the fit says that the clip tells has to be
right: the ratio within 15 %, eta / E within 20 %, nu within 0.02; about the rest it has to say that it cannot tell.

Error model: noise averages out over hundreds of points; what remains is the difference between the two solvers at the
grid's spacing (`manipulation`), which every parameter shares in.
"""

import numpy as np

from surgisim.estimation.identify import identifiability
from surgisim.estimation.observation import PHASES
from surgisim.estimation.rounds import INDEPENDENT
from surgisim.verification.drawing import COLORS, panels
from surgisim.verification.manipulated.fit import NOISE, fitted, halves, phase_of, tracked
from surgisim.verification.manipulated.scene import DENSITY, Scene, invent
from surgisim.verification.markdown import table

TITLE = "Planted parameters"

SEEDS, SPACING, EDGE = tuple(range(101, 109)), 4e-3, 2e-3
"""Seeds, spacing of the grid and edges of the finite elements [m]."""
ELASTIC = "neo_hookean_ciarlet"
WITHIN = {"ratio": 0.15, "eta_over_E": 0.20, "nu": 0.02}


def measure(progress, quick: bool = False) -> dict:
    rows = []
    for done, seed in enumerate(SEEDS[:1] if quick else SEEDS):
        progress(done, len(SEEDS), f"seed {seed}")
        rows.append(found(invent(seed)))
    return {"noise": NOISE, "spacing": SPACING, "edge": EDGE, "within": WITHIN, "rows": rows}


def found(scene: Scene) -> dict:
    """True and fitted values of one seed, and what the fit says it can tell."""
    split, probes = halves(scene), scene.probes()
    last = scene.holds[1].begin
    seen = tracked(scene, EDGE, probes, split, last + 1)
    trial, solution = fitted(scene, SPACING, seen, split, last, seed=scene.seed)
    table_ = identifiability(
        solution, trial.wanted, phase_of=phase_of(trial), phase_names=PHASES, density=DENSITY,
        length=scene.shape.thickness, independent=INDEPENDENT,
    )  # fmt: skip
    true = {"ratio": split.ratio, "eta_over_E": scene.law.eta / scene.law.E, "nu": scene.law.nu, "E": scene.law.E}
    keys = {
        "ratio": "stiff_inclusion.s", "eta_over_E": f"newtonian.eta / {ELASTIC}.E", "nu": f"{ELASTIC}.nu",
        "E": f"{ELASTIC}.E",
    }  # fmt: skip
    row = {"seed": scene.seed, "thickness": scene.shape.thickness}
    for name, key in keys.items():
        got = table_[key]
        error = got["value"] - true[name] if name == "nu" else got["value"] / true[name] - 1
        row[name] = {
            "true": true[name],
            "error": float(error),
            **{k: got[k] for k in ("value", "low", "high", "told", "phases")},
        }
    return row


def right(row: dict) -> dict[str, bool]:
    """For each bounded quantity: within its bound, or called untold."""
    return {n: bool(abs(row[n]["error"]) <= bound or not row[n]["told"]) for n, bound in WITHIN.items()}


def draw(result: dict):
    figure, axes = panels(3)
    labels = {"ratio": "ratio of the regions [1]", "eta_over_E": "eta / E [ms]", "nu": "nu [1]"}
    for ax, name in zip(axes, WITHIN, strict=True):
        scale = 1e3 if name == "eta_over_E" else 1.0
        rows = [r[name] for r in result["rows"]]
        true = np.array([r["true"] for r in rows]) * scale
        value = np.array([r["value"] for r in rows]) * scale
        spread = np.abs(np.array([[r["low"], r["high"]] for r in rows]).T * scale - value)
        told = np.array([r["told"] for r in rows])
        ends = np.array([min(true.min(), value.min()), max(true.max(), value.max())])
        ax.plot(ends, ends, color="#1c2127", linewidth=0.8)
        for shown, color, label in ((told, COLORS[0], "told"), (~told, COLORS[1], "cannot tell")):
            if shown.any():
                ax.errorbar(
                    true[shown],
                    value[shown],
                    spread[:, shown],
                    fmt="o",
                    color=color,
                    label=label,
                    linewidth=1,
                    capsize=3,
                )
        ax.set(xlabel=f"planted {labels[name]}", ylabel="found", title=labels[name])
        ax.legend(frameon=False, fontsize=8)
    return figure


def words(result: dict) -> str:
    rows = []
    for r in result["rows"]:
        cells = [r["seed"]]
        for name in ("ratio", "eta_over_E", "nu", "E"):
            q, scale = r[name], 1e3 if name == "eta_over_E" else 1.0
            error = f"{q['error']:+.3f}" if name == "nu" else f"{100 * q['error']:+.1f} %"
            cells.append(
                f"{scale * q['true']:.3g} / {scale * q['value']:.3g} ({error}{'' if q['told'] else ', cannot tell'})"
            )
        rows.append([*cells, "yes" if all(right(r).values()) else "no"])
    return f"""
Tracks of the upper side from finite elements ({1e3 * result["edge"]:.1f} mm edges), noise
{1e3 * result["noise"]:.1f} mm, fitted on a {1e3 * result["spacing"]:.1f} mm grid over one pull, hold and release.
Bounds:
ratio 15 %, eta / E 20 %, nu 0.02, for what the fit says it can tell. Planted / found (error):

{table(["seed", "ratio of the regions", "eta / E [ms]", "nu", "E [Pa]", "within bounds"], rows)}"""
