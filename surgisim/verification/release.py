"""Pulled, held and let go: the same tissue at the default step and at smaller ones, and a fit carried between them.

A slab held at its back is pulled at its face by a grip and released; the face's motion after the release is compared
between the default step and smaller ones. Then E and eta are fitted, at the default step, to the motion that a quarter
of it makes with other values, and simulated at that quarter: what a fit at one step size is worth at another.

Error model: symplectic Euler is late or early by half a step, so the difference falls with the first power of the step
and is bounded by half a step's motion; the fit must therefore return the parameters up to a share of omega dt.
"""

import numpy as np
from scipy.optimize import least_squares

from surgisim.artifacts.motion import Motion
from surgisim.verification.drawing import COLORS, legend, panels, reference, slope
from surgisim.verification.markdown import table
from surgisim.verification.rod import Rod, block, rod

TITLE = "A release at another step size"

FPS, SAMPLES = 25.0, 4
"""Frames of the recording, and samples a frame."""
PULL, HOLD, FRAMES = 5, 8, 20
"""Frames until the grip has arrived, until it lets go, and in all."""
BY, RADIUS = (0.004, 0.003, 0.0), 0.0065
TRUTH, START = {"E": 1500.0, "eta": 1.0}, {"E": 900.0, "eta": 0.5}
STIFFEST = 1.2
"""The default step is the one for parameters this much larger than the true ones: a search may go that far."""
NU, BOUND = 0.42, 0.1


def measure(progress, quick: bool = False) -> dict:
    spacing, several = (0.009, (1, 4)) if quick else (0.0045, (1, 2, 4, 16))
    laid = rod(block((0.018, 0.036, 0.036), spacing, spacing / 2), _values(**TRUTH))
    largest = {name: STIFFEST * value for name, value in TRUTH.items()}
    base = laid.made.per_frame(_values(**largest), FPS * SAMPLES)
    runs = {}
    for done, refine in enumerate(several):
        progress(done, len(several) + 1, f"step / {refine}")
        runs[refine] = face(laid, TRUTH, base * refine)
    finest, size = runs[several[-1]], _rms(runs[several[-1]])
    rows = [
        {"refine": n, "step": 1 / FPS / SAMPLES / base / n, "off_finest": _rms(runs[n] - finest) / size}
        for n in several[:-1]
    ]
    progress(len(several), len(several) + 1, "fit at the default step")
    fitted = fit(laid, runs[4], base)
    predicted = face(laid, fitted, 4 * base)
    point = int(np.argmax(np.abs(finest).max((0, 2))))
    return {
        "bound": BOUND,
        "spacing": spacing,
        "particles": len(laid.made.body.rest),
        "rows": rows,
        "off_quarter": _rms(runs[1] - runs[4]) / _rms(runs[4]),
        "order": slope([r["step"] for r in rows], [r["off_finest"] for r in rows]) if len(rows) > 1 else None,
        "truth": TRUTH,
        "start": START,
        "fitted": fitted,
        "off_predicted": _rms(predicted - runs[4]) / _rms(runs[4]),
        "time": (HOLD + np.arange(len(finest)) / SAMPLES) / FPS,
        "curves": {str(n): runs[n][:, point, 0] for n in several},
        "curve_predicted": predicted[:, point, 0],
    }


def face(laid: Rod, values: dict, per_sample: int) -> np.ndarray:
    """Displacement [m] of the face's particles from the release on, (T, Q, 3)."""
    made, rest = laid.made, laid.made.body.rest.astype(float)
    drive = made.drive(pulled(), _values(**TRUTH), fps=FPS * SAMPLES, per_frame=per_sample)
    out = made.simulator.run(made.theta(_values(**values)), drive)
    front = rest[rest[:, 0] > rest[:, 0].max() - 1e-6]
    carry = made.simulator.carry(front)
    return np.stack([carry @ u.astype(float) for u in out.u[HOLD * SAMPLES :]])


def fit(laid: Rod, recording: np.ndarray, per_sample: int) -> dict:
    """E [Pa] and eta [Pa s] that come closest to a recording of the face with so many steps a sample."""

    def residual(x):
        return (face(laid, dict(zip(START, np.exp(x).tolist(), strict=True)), per_sample) - recording).ravel() / 1e-3

    begin, highest = np.log(list(START.values())), np.log(STIFFEST * np.array(list(TRUTH.values())))
    found = least_squares(residual, begin, bounds=(-np.inf, highest), diff_step=1e-3, xtol=1e-5, ftol=1e-6, max_nfev=12)
    return dict(zip(START, np.exp(found.x).tolist(), strict=True))


def pulled() -> Motion:
    """A grip at the middle of the face, carried away within PULL frames, and gone after HOLD."""
    time = np.arange((FRAMES - 1) * SAMPLES + 1) / SAMPLES
    s = np.clip(time / PULL, 0, 1)
    center = np.array([[0.018, 0.0, 0.0]])
    position = center + (s * s * (3 - 2 * s))[:, None] * np.array(BY)
    return Motion(center, np.array([RADIUS]), position[None], (time <= HOLD)[None], np.ones(1), "given")


def _values(E: float, eta: float) -> dict:
    return {"corotated": {"E": E, "nu": NU}, "newtonian": {"eta": eta}}


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))


def draw(result: dict):
    figure, (left, right) = panels(2)
    time = np.array(result["time"])
    for color, (refine, curve) in zip(COLORS, result["curves"].items(), strict=False):
        label = "default step" if refine == "1" else f"step / {refine}"
        left.plot(time, 1000 * np.array(curve), color=color, linewidth=1.2, label=label)
    predicted = 1000 * np.array(result["curve_predicted"])
    left.plot(time, predicted, "o", markersize=3, color="#1c2127", label="fitted at 1, simulated at 1/4")
    left.set(xlabel="time [s]", ylabel="face, where it moves most [mm]", title="after the release")
    x, y = [1000 * r["step"] for r in result["rows"]], [100 * r["off_finest"] for r in result["rows"]]
    slope_told = "" if result["order"] is None else f" (slope {result['order']:.2f})"
    right.loglog(x, y, "o-", color=COLORS[0], label=f"off the finest{slope_told}")
    if len(x) > 1:
        reference(right, x, 1.5 * max(y), 1)
    right.set(xlabel="step [ms]", ylabel="RMS difference / RMS motion [%]", title="step size alone")
    legend(left)
    legend(right)
    return figure


def words(result: dict) -> str:
    rows = [[r["refine"], f"{1000 * r['step']:.4f}", f"{100 * r['off_finest']:.2f} %"] for r in result["rows"]]
    fits = [[n, result["truth"][n], result["start"][n], f"{result['fitted'][n]:.4f}"] for n in result["truth"]]
    order = "" if result["order"] is None else f" (slope over the step {result['order']:.2f}, 1 expected)"
    return f"""
A slab of tissue, {result["particles"]} particles, spacing {1000 * result["spacing"]:.1f} mm, is pulled at its face,
held and let go. Difference of the face's motion after the release, in the root mean square, between the default step
and a quarter of it: {100 * result["off_quarter"]:.2f} % of the motion; against the finest step{order}:

{table(["default step over", "step [ms]", "off the finest"], rows)}
E and eta fitted at the default step to what a quarter of it made, and then simulated at that quarter: the motion
after the release is off by {100 * result["off_predicted"]:.2f} % (bound: {100 * result["bound"]:.0f} %).

{table(["", "made with", "search began at", "fitted"], fits)}"""
