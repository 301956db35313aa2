"""What the comparison of the two solvers says, in words and tables."""

import numpy as np

from surgisim.verification.manipulated.compare import RINGS
from surgisim.verification.markdown import table

BOUNDS = {"share": 0.10, "difference": 0.3e-3, "lasting": 0.05e-3, "late": 0.05}
"""What is accepted at the default grid: of the motion, [m], [m] and of the rebound's time."""


def words(result: dict) -> str:
    default = min(r["cells"] for r in result["rows"])
    rows = []
    for scene, r in zip(result["scenes"], [r for r in result["rows"] if r["cells"] == default], strict=True):
        told = [scene["seed"], f"{1000 * scene['thickness']:.1f}", f"{scene['E'] / 1000:.2f}", f"{scene['nu']:.3f}"]
        told += [f"{1000 * scene['eta'] / scene['E']:.1f}", f"{1000 * scene['radii'][0]:.1f}"]
        told += [f"{1000 * scene['pulls'][0]:.1f} at {np.degrees(scene['lifts'][0]):.0f}", f"{1000 * r['spacing']:.2f}"]
        told += [f"{1000 * r['motion']:.2f}", f"{1000 * r['difference']:.3f}", f"{100 * r['share']:.1f} %"]
        others = [o for o in result["rows"] if o["seed"] == scene["seed"] and o["cells"] > default]
        told += [", ".join(f"{100 * o['share']:.1f} %" for o in others), f"{100 * r['elements']['share']:.1f} %"]
        told += [f"{1000 * r['phases']['hold']:.3f}", f"{1000 * r['lasting']:.4f}"]
        told += [f"{1000 * r['rebound'][0]:.1f} / {1000 * r['rebound'][1]:.1f}", f"{100 * r['late']:+.1f} %"]
        rows.append(told)
    head = [
        "seed", "thickness [mm]", "E [kPa]", "nu", "eta/E [ms]", "grip [mm]", "pull [mm at deg]", "grid [mm]",
        "motion RMS [mm]", "difference RMS [mm]", "share", "share on finer grids", "elements' own", "held [mm]",
        "lasting [mm]", "first rebound, engine / elements [ms]", "late by",
    ]  # fmt: skip
    firsts = [r for r in result["rows"] if r["cells"] == default]
    rings = []
    for ring in RINGS:
        engine, own = ([r["rings"][ring] for r in some] for some in (firsts, [r["elements"] for r in firsts]))
        columns = [[r["motion"] for r in engine], [r["difference"] for r in engine], [r["difference"] for r in own]]
        power = f"{result['slope']['rings'][ring]:.1f}" if result["slope"] else ""
        rings.append([ring, *(f"{1000 * np.mean(c):.3f}" for c in columns), power])
    worst = {key: max(abs(r[key]) for r in firsts) for key in BOUNDS}
    text = f"""
Both solvers have the same law, parameters and path and share no code. {len(result["scenes"])} invented blocks are
pulled, held, let go, and pulled elsewhere; compared at surface points 2.5 mm apart, at every frame. Grid: {default}
cells along the longest side and 8 particles a cell, as `thickening` makes them. Elements:
{1000 * result["edges"][-1]:.2f} mm; "elements' own" is by how much those of {1000 * result["edges"][0]:.2f} mm differ.

{table(head, rows)}
Largest: difference {1000 * worst["difference"]:.3f} mm (bound {1000 * BOUNDS["difference"]:.1f}) and
{100 * worst["share"]:.1f} % of the motion (bound {100 * BOUNDS["share"]:.0f} %), lasting
{1000 * worst["lasting"]:.4f} mm (bound {1000 * BOUNDS["lasting"]:.2f}), rebound off by {100 * worst["late"]:.1f} %
(bound {100 * BOUNDS["late"]:.0f} %).

Where it is, at the end of the first hold, mean of all seeds:

{table(["distance", "motion [mm]", "difference [mm]", "elements' own [mm]", "power of the spacing"], rings)}
"""
    if result["slope"]:
        powers = ", ".join(f"{v:.2f}" for v in result["slope"]["seeds"].values())
        text += f"\nPower of the spacing with which the whole difference falls, by seed: {powers}.\n"
    ladder = result["shown"].get("ladder")
    if ladder:
        steps = ", ".join(
            f"{1000 * h:.2f} mm by {1000 * d:.3f} mm"
            for h, d in zip(ladder["edges"], ladder["difference"], strict=True)
        )
        text += (
            f"\nThe elements of seed {result['shown']['seed']} differ from those of {1000 * ladder['finest']:.2f} mm, "
            f"when the pull has arrived: {steps}.\n"
        )
    e = result["model_error"]
    hold = ", ".join(f"{1000 * s:.0f}" for s in e["deviation"][1])
    times = ", ".join(f"{name} {t:.2f} s" for name, t in e["time"].items())
    edges = ", ".join(f"{x:g}" for x in e["edges"])
    text += f"""
**Model error.** What remains is written down for the diagnosis (`model_error` in manipulation.json, used by
`surgisim/verification/manipulated/covariance.py`): its standard deviation per component and unit of the grip's motion,
by phase and distance (while held, in thousandths, between {edges} radii: {hold}), its correlation length
({1000 * e["length"]:.1f} mm) and times ({times}), the pattern that comes back with every grip, and {len(e["modes"])}
modes around it ({100 * e["explained"]:.0f} % of the rest).

**What does not hold.** Within 1.6 radii of the grip the engine is off by several tenths of a millimetre, where the
strain is singular and the elements themselves are not settled either; there it falls hardly faster than the spacing. A
grip smaller than half a cell is carried as if it were as large as that. Rebounds are off by up to
{100 * worst["late"]:.0f} %, most of them late: lumped nodal masses slow a quarter wave over three cells by 4 %.
"""
    return text
