"""Parameters planted in another solver and found from its tracks: two regions, one pull, its hold and release.

Eight blocks (as in `manipulation`) are pulled by the phantom's finite elements; beyond an upright plane between the two
grips the tissue is 1.5-3 times stiffer. Tracks of the upper side, with noise, go into the same search that a clip's go
into: E, nu, eta and the ratio of the regions (the plane is given). What the fit says that the clip tells has to be
right: the ratio within 15 %, eta / E within 20 %, nu within 0.02; about the rest it has to say that it cannot tell.

Error model: noise averages out over hundreds of points; what remains is the difference between the two solvers at the
grid's spacing (`manipulation`). It is no noise: it comes back alike in every scene, and no misfit shows it. What it
does to the parameters is measured on other seeds, where the truth is known: the step that a fit takes away from it. The
mean square of those steps belongs to every interval.
"""

import numpy as np

from surgisim.estimation.identify import identifiability
from surgisim.estimation.observation import PHASES
from surgisim.estimation.rounds import INDEPENDENT
from surgisim.estimation.search import search
from surgisim.verification.drawing import COLORS, panels
from surgisim.verification.manipulated.fit import (
    NOISE,
    Halves,
    fitted,
    halves,
    mistaken,
    phase_of,
    tracked,
    trial,
    truth,
)
from surgisim.verification.manipulated.particles import TERMS
from surgisim.verification.manipulated.scene import DENSITY, Scene, invent
from surgisim.verification.markdown import table

TITLE = "Planted parameters"

SEEDS, SPACING, EDGE = tuple(range(101, 109)), 4e-3, 2e-3
"""Seeds, spacing of the grid and edges of the finite elements [m]."""
CALIBRATION = tuple(range(109, 113))
"""Seeds of the scenes on which the solvers' difference is measured."""
AFTER = 10
"""Frames after the release that are looked at."""
ELASTIC = "neo_hookean_ciarlet"
WITHIN = {"ratio": 0.15, "eta_over_E": 0.20, "nu": 0.02}


def measure(progress, quick: bool = False) -> dict:
    seeds, calibration = (SEEDS[:1], CALIBRATION[:1]) if quick else (SEEDS, CALIBRATION)
    total, steps = len(seeds) + len(calibration), []
    for done, seed in enumerate(calibration):
        progress(done, total, f"calibration, seed {seed}")
        scene, split, seen, last = watched(seed)
        steps.append(mistaken(trial(scene, SPACING, seen, split, last, seed=seed, start=truth(scene, split))))
    model = np.mean([np.outer(s, s) for s in steps], 0)
    rows = []
    for done, seed in enumerate(seeds):
        progress(len(calibration) + done, total, f"seed {seed}")
        rows.append(found(seed, model))
    names = [f"{law}.{p}" for law, p, _ in search([*TERMS, "stiff_inclusion"], {}, []).free]
    told = {"seeds": calibration, "names": names, "steps": steps, "model": model}
    return {"noise": NOISE, "spacing": SPACING, "edge": EDGE, "within": WITHIN, "calibration": told, "rows": rows}


def watched(seed: int) -> tuple[Scene, Halves, np.ndarray, int]:
    """A seed's scene, its halves, the tracks of its upper side [m], (T, K, 3), and the last frame that is fitted."""
    scene = invent(seed)
    split = halves(scene)
    return (
        scene,
        split,
        tracked(scene, EDGE, scene.probes(), split, scene.holds[1].begin + 1),
        scene.holds[0].release + AFTER,
    )


def found(seed: int, model: np.ndarray) -> dict:
    """True and fitted values of one seed, and what the fit says it can tell."""
    scene, split, seen, last = watched(seed)
    tried, solution = fitted(scene, SPACING, seen, split, last, seed=seed)
    table_ = identifiability(
        solution, tried.wanted, phase_of=phase_of(tried), phase_names=PHASES, density=DENSITY,
        length=scene.shape.thickness, independent=INDEPENDENT, region=tried.regions, model={"grid": model},
    )  # fmt: skip
    true = {"ratio": split.ratio, "eta_over_E": scene.law.eta / scene.law.E, "nu": scene.law.nu, "E": scene.law.E}
    keys = {
        "ratio": "stiff_inclusion.s", "eta_over_E": f"newtonian.eta / {ELASTIC}.E", "nu": f"{ELASTIC}.nu",
        "E": f"{ELASTIC}.E",
    }  # fmt: skip
    row = {"seed": seed, "thickness": scene.shape.thickness}
    for name, key in keys.items():
        got = table_[key]
        error = got["value"] - true[name] if name == "nu" else got["value"] / true[name] - 1
        row[name] = {
            "true": true[name],
            "error": float(error),
            "covered": bool(got["low"] <= true[name] <= got["high"]),
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
    names, rows = ("ratio", "eta_over_E", "nu", "E"), []
    for r in result["rows"]:
        cells = [r["seed"]]
        for name in names:
            q, scale = r[name], 1e3 if name == "eta_over_E" else 1.0
            error = f"{q['error']:+.3f}" if name == "nu" else f"{100 * q['error']:+.1f} %"
            interval = f"{scale * q['low']:.3g} to {scale * q['high']:.3g}"
            cells.append(f"{scale * q['true']:.3g} / {scale * q['value']:.3g} ({interval}; {error}{_remark(q)})")
        rows.append([*cells, "yes" if all(right(r).values()) else "no"])
    covered = sum(r[n]["covered"] for r in result["rows"] for n in WITHIN)
    untold = sum(not r[n]["told"] for r in result["rows"] for n in WITHIN)
    steps = result["calibration"]
    off = [
        [seed, *(f"{part:+.3f}" for part in step)] for seed, step in zip(steps["seeds"], steps["steps"], strict=False)
    ]
    return f"""
Tracks of the upper side from finite elements ({1e3 * result["edge"]:.1f} mm edges), noise
{1e3 * result["noise"]:.1f} mm, fitted on a {1e3 * result["spacing"]:.1f} mm grid over one pull, hold and release.
Bounds: ratio 15 %, eta / E 20 %, nu 0.02, for what the fit says it can tell. Planted / found (90 % interval; error):

{table(["seed", "ratio of the regions", "eta / E [ms]", "nu", "E [Pa]", "within bounds"], rows)}
Of the {len(WITHIN) * len(rows)} bounded numbers {covered} lie in their 90 % interval; {untold} are called untold. The
intervals hold what the solvers' difference does to the parameters of other scenes (logarithms; nu as it is), the step
that a fit takes away from the truth:

{table(["seed", *steps["names"]], off)}"""


def _remark(q: dict) -> str:
    return ("" if q["covered"] else ", outside") + ("" if q["told"] else ", cannot tell")
