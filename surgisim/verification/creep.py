"""Relaxation at a prescribed stretch and creep under a dead load, against the closed form of the linear solid.

A square rod with nu = 0 (so that it is one-dimensional to the last digit) and strains of 1e-3. Relaxation: both end
caps are anchored, one is carried 1e-3 of the length away and held there; the anchors' pull over the cross-section is
compared with the stress that the closed form gives for the strain of the rod's middle half. Creep: the rod hangs from
one cap, gravity is switched on, and the lengthening of its lower three quarters is compared with the closed form,
inertia included. A solid without viscosity would bounce for long: it first settles as the elastic solid that it is
before anything relaxes, and is left to creep from there.

A law enters as one line of LAWS: its parameters, and the one-dimensional solid that it is (linear_solid.py). The law
2 eta D is an axial viscosity 2 eta when nu = 0; a branch that relaxes in shear alone makes the rod a standard linear
solid whose one branch is slower than the law's (LinearSolid.of_shear).
"""

from dataclasses import replace

import numpy as np

from surgisim.artifacts.motion import Motion
from surgisim.mpm.grip import Drive
from surgisim.mpm.simulator import Run
from surgisim.physics.catalogue import catalogue
from surgisim.verification.drawing import COLORS, legend, panels
from surgisim.verification.linear_solid import LinearSolid
from surgisim.verification.markdown import table
from surgisim.verification.rod import DENSITY, Rod, block, rod

TITLE = "Relaxation and creep"

LENGTH, SIDE, STRAIN, GRAVITY = 0.036, 0.009, 1e-3, 1.0
RAMP, SETTLED, SAMPLES = 0.1, 0.3, 200
E, ETA = 30000.0, 300.0
FIRM = 15.0
"""Anchors as stiff as this times their default, so that what they hold hardly gives way; their pull is then a
difference of nearly equal numbers, which is why everything here is computed in double precision."""
ELASTIC = {"corotated": {"E": E, "nu": 0.0}}
SHEAR, TAU = 6000.0, 0.25
LAWS = {
    "corotated + newtonian": (ELASTIC | {"newtonian": {"eta": ETA}}, LinearSolid(E, 2 * ETA), 0.25),
    "corotated + relaxation": (
        ELASTIC | {"relaxation": {"G": SHEAR, "tau": TAU}},
        LinearSolid.of_shear(E, 0.0, SHEAR, TAU),
        0.75,
    ),
}
"""Parameters, the solid that the rod then is, and how long it is watched [s]."""


def measure(progress, quick: bool = False) -> dict:
    # A law that is not in the catalogue (yet) is left out.
    there = {name: law for name, law in LAWS.items() if set(law[0]) <= set(catalogue())}
    plan = [(name, SIDE / cells) for name in there for cells in ((2,) if quick else (2, 3))]
    rows = []
    for done, (name, spacing) in enumerate(plan):
        progress(done, len(plan), f"{name}, spacing {1000 * spacing:.1f} mm")
        values, solid, duration = there[name]
        held, hung = relaxation(values, solid, spacing, duration), creep(values, solid, spacing, duration)
        rows.append({"laws": name, "spacing": spacing, "relaxation": held, "creep": hung})
    return {"length": LENGTH, "side": SIDE, "strain": STRAIN, "gravity": GRAVITY, "rows": rows}


def relaxation(values: dict, solid: LinearSolid, spacing: float, duration: float) -> dict:
    """Stress [Pa] of a rod whose ends are moved apart and held, from the anchors' pull and after the closed form."""
    # A cap of one cell at either end.
    laid = rod(block((LENGTH + spacing, SIDE, SIDE), spacing, spacing), values, precision="double")
    drive, time = _drive(laid, STRAIN * LENGTH, duration)
    far = laid.made.body.rest[:, 0] > LENGTH
    member = laid.made.body.held.astype(np.int32) | (far.astype(np.int32) << 1)
    drive = replace(drive, member=member, share=(member > 0).astype(float))
    out = laid.made.simulator.run(laid.made.theta(values), drive)
    u = _along(laid, laid.made.body.rest.astype(float), out.u)
    mass = laid.made.body.volume.astype(float) * DENSITY
    at = np.arange(len(time)) * drive.per_frame
    pulls = [
        drive.stiffness[a, 0, 0] * ((drive.path[a, at, 0][:, None] - u[:, cap]) @ mass[cap])
        for a, cap in enumerate((laid.made.body.held, far))
    ]
    gauge = _along(laid, np.array([[LENGTH / 4, 0.0, 0.0], [3 * LENGTH / 4, 0.0, 0.0]]), out.u)
    strain = (gauge[:, 1] - gauge[:, 0]) / (LENGTH / 2)
    found = (pulls[1] - pulls[0]) / 2 / SIDE**2
    return _compared(time, found, solid.stress(time, strain))


def creep(values: dict, solid: LinearSolid, spacing: float, duration: float) -> dict:
    """Lengthening [m] of a hanging rod's lower three quarters under gravity, measured and after the closed form."""
    begin = None if solid.eta else (_hung(_settling(solid), spacing, SETTLED)[1].u[-1],)
    laid, out, time = _hung(values, spacing, duration, begin)
    # From a quarter on: where exactly the clamp holds the rod is the bar's subject, not the law's.
    gauge = np.array([[LENGTH / 4, 0.0, 0.0], [LENGTH, 0.0, 0.0]])
    found, wanted = _along(laid, gauge, out.u), solid.hung(time, gauge[:, 0], LENGTH, DENSITY, GRAVITY)
    return _compared(time, found[:, 1] - found[:, 0], wanted[:, 1] - wanted[:, 0])


def _hung(values: dict, spacing: float, duration: float, begin=None) -> tuple[Rod, Run, np.ndarray]:
    """A rod under gravity, its run, and the times of its frames [s]; `begin`: displacement of the nodes, or nothing."""
    laid = rod(block((LENGTH, SIDE, SIDE), spacing, spacing), values, gravity=(GRAVITY, 0.0, 0.0), precision="double")
    # The carried cap lies beyond this rod: only the held one is left of the drive.
    drive, time = _drive(laid, 0.0, duration)
    drive = replace(drive, member=laid.made.body.held.astype(np.int32))
    return laid, laid.made.simulator.run(laid.made.theta(values), drive, begin=begin), time


def _settling(solid: LinearSolid) -> dict:
    """What a solid is before anything relaxes, with viscosity to bring it to rest."""
    return {"corotated": {"E": solid.fast, "nu": solid.fast_nu}, "newtonian": {"eta": ETA}}


def _drive(laid: Rod, by: float, duration: float) -> tuple[Drive, np.ndarray]:
    """The far end carried away by `by` [m] without a jerk during RAMP, and the times of the frames [s]."""
    time = np.linspace(0, duration, SAMPLES + 1)
    s = np.clip(time / RAMP, 0, 1)
    center = np.array([[LENGTH, 0.0, 0.0]])
    position = center + (by * s**3 * (10 - 15 * s + 6 * s**2))[:, None] * np.array([1.0, 0.0, 0.0])
    active = np.ones((1, len(time)), bool)
    motion = Motion(center, np.array([SIDE]), position[None], active, np.ones(1), "given")
    rough = laid.made.drive(motion, laid.values, fps=1 / time[1], per_frame=1)
    springs = FIRM * rough.stiffness
    step = min(laid.step, 0.5 / np.sqrt(springs.max()))
    drive = laid.made.drive(motion, laid.values, fps=1 / time[1], per_frame=int(np.ceil(time[1] / step)))
    return replace(drive, stiffness=springs), time


def _along(laid: Rod, points: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Displacement along x [m] of rest points (Q, 3), (T, Q)."""
    return (laid.made.simulator.carry(points) @ u[..., 0].astype(float).T).T


def _compared(time: np.ndarray, found: np.ndarray, wanted: np.ndarray) -> dict:
    largest = np.abs(wanted).max()
    off = np.abs(found - wanted) / largest
    return {"time": time, "found": found, "wanted": wanted, "largest_error": off.max(), "rms_error": _rms(off)}


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))


def draw(result: dict):
    figure, (left, right) = panels(2)
    finest = {row["laws"]: row for row in result["rows"]}
    for color, (name, row) in zip(COLORS, finest.items(), strict=False):
        for ax, what, scale in ((left, "relaxation", 1.0), (right, "creep", 1e6)):
            curve = row[what]
            ax.plot(
                curve["time"][::4], scale * np.array(curve["found"][::4]), "o", markersize=3, color=color, label=name
            )
            ax.plot(curve["time"], scale * np.array(curve["wanted"]), color="#1c2127", linewidth=1)
    for ax in (left, right):
        ax.plot([], [], color="#1c2127", linewidth=1, label="closed form")
    left.set(xlabel="time [s]", ylabel="stress [Pa]", title="stretched and held")
    right.set(xlabel="time [s]", ylabel="lengthening [um]", title="creep under its own weight")
    legend(left)
    legend(right)
    return figure


def words(result: dict) -> str:
    rows = []
    for row in result["rows"]:
        told = [row["laws"], f"{1000 * row['spacing']:.1f}"]
        for what in ("relaxation", "creep"):
            told += [f"{100 * row[what][e]:.2f} %" for e in ("largest_error", "rms_error")]
        rows.append(told)
    head = ["laws", "spacing [mm]", "stress: largest error", "RMS", "creep: largest error", "RMS"]
    return f"""
A rod of {1000 * result["length"]:.0f} x {1000 * result["side"]:.0f} x {1000 * result["side"]:.0f} mm, nu 0, strains of
{result["strain"]:g}. Stretched within {RAMP} s and held: the pull of the anchors against the closed form for the
strain of the middle half. Hung up by one end under gravity ({result["gravity"]} m/s²): the lengthening of the lower
three quarters against the closed form; a solid that has no viscosity starts where it hangs before anything relaxes.
Errors are shares of the largest value; bound: 1 %.

{table(head, rows)}"""
