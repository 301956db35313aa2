"""A silicone beam that is let go under gravity, motion capture of the real thing: fit one take, predict the other.

    decay = omega^2 eta' / (2 E')        Kelvin-Voigt: a mode's decay grows with the square of its frequency

E and eta are fitted to frequency and decay of the free end on take a, one number each, and nothing is changed for
take b but the state from which it starts. Frequency and decay of recorded and simulated swings are read off by one
formula (ringing.py). Recordings: Dubied, Michelis, Spielberg and Katzschmann, RA-L 2022; their E 263,824 Pa, density
1070 kg/m^3, nu 0.499, and the drop of 6.75 mm that COMSOL gave them for these.
"""

from pathlib import Path

import numpy as np

from surgisim.verification.cases import data
from surgisim.verification.ringing import CREEP, Ringing, ringing
from surgisim.verification.silicone_page import draw, words
from surgisim.verification.silicone_run import Swing, swing
from surgisim.verification.silicone_take import FPS, MAKERS_E, take, tip

__all__ = ["draw", "measure", "words"]

TITLE = "A silicone beam let go (recorded)"
DATA = "silicone_beam_mocap"

NU = 0.45
FIRST = {"E": MAKERS_E, "nu": NU, "eta": 200.0}
BEGIN, END = 0.1, 1.6
"""Window of the fits after the release [s]."""
SECONDS, SHORT = 1.8, 0.9
FREQUENCY, LOADED = 7.6, 4.3
"""First guesses [Hz]."""
SWINGS = 3
"""Length of a window of the decay's dependence on amplitude."""
SPACING, COARSE = 0.0075, 0.010
"""Four and three cells across the beam [m]."""


def measure(progress, quick: bool = False) -> dict:
    folder = data(DATA)
    takes = {k: take(folder / f"beam_gravity_V2_{k}.c3d") for k in "ab"}
    spacing = COARSE if quick else SPACING
    values, history, free = fit(takes["a"], spacing, progress)
    known = read(above_rest(takes["a"]), FREQUENCY)
    rows, traces = {}, {}
    for k, recording in takes.items():
        progress(0, 1, f"take {k} from its first low point")
        rows[k], traces[k] = predict(recording, values, spacing, free, known)
    result = {"spacing": spacing, "values": values, "fit": history, "takes": rows, "traces": traces}
    result["drop"] = {"simulated": free.drop, "held": {k: held(r) for k, r in takes.items()}}
    result["recorded"] = recorded(folder)
    grids = () if quick else (COARSE, SPACING, 0.006, 0.005)
    result["grids"] = [study(takes["a"], values, g, NU, progress) for g in grids]
    several = [] if quick else [(nu, held) for held in (None, 0.48) for nu in (0.30, 0.45, 0.48)]
    result["nu"] = [study(takes["a"], values, COARSE, nu, progress, held) for nu, held in several]
    return result


def fit(recording, spacing: float, progress) -> tuple[dict, list[dict], Swing]:
    """E and eta [Pa, Pa s] that give take a's frequency and decay; every round; and the last run."""
    aim = read(above_rest(recording), FREQUENCY)
    values, history = dict(FIRST), []
    for round_ in range(4):
        progress(round_, 4, f"fit: E {values['E']:.0f} Pa, eta {values['eta']:.0f} Pa s")
        free = swing(recording, **values, spacing=spacing, seconds=SECONDS)
        got = read(free.y, FREQUENCY)
        history.append(dict(values) | {"frequency": got.frequency, "decay": got.decay})
        if abs(got.frequency / aim.frequency - 1) < 1e-3 and abs(got.decay / aim.decay - 1) < 5e-3:
            break
        # Frequency goes with the root of E; the decay of a Kelvin-Voigt solid with eta alone.
        values["E"] *= (aim.frequency / got.frequency) ** 2
        values["eta"] *= aim.decay / got.decay
    return values, history, free


def predict(recording, values: dict, spacing: float, free: Swing, known: Ringing) -> tuple[dict, dict]:
    """A take's swings about its creeping midline against the engine, begun at the first low point.

    There nobody holds the beam any more. Height and speed are taken from the take's first swing, nothing else; `known`
    is take a's ringing.
    """
    y = above_rest(recording)
    t = np.arange(len(y)) / recording.fps
    swings = y - read(y, FREQUENCY).midline(t)
    low = int(np.argmin(y[: round(0.15 * recording.fps)]))
    start = (*first_swing(swings[low:], known), free.settled, free.drop)
    run = swing(recording, **values, spacing=spacing, seconds=SECONDS, begin=start)
    seen = swings[low : low + len(run.y)]
    window = {"begin": 0.0, "end": END - BEGIN, "frequency": FREQUENCY}
    real, made = ringing(y[low:], recording.fps, **window), ringing(run.y, recording.fps, **window)
    row = {
        "frequency": real.frequency,
        "decay": real.decay,
        "simulated": {"frequency": made.frequency, "decay": made.decay},
        "frequency_error": made.frequency / real.frequency - 1,
        "decay_error": made.decay / real.decay - 1,
        "apart": float(np.sqrt(np.mean((seen - run.y) ** 2))),
        "motion": float(np.sqrt(np.mean(seen**2))),
        "midline": float(real.midline(t[:1])[0] - real.midline(t[-1:])[0]),
        "steps_per_second": run.per_frame * recording.fps,
    }
    return row, {"low": low, "recorded": y[: low + len(run.y)], "swings": seen, "simulated": run.y, "straight": free.y}


def first_swing(y: np.ndarray, known: Ringing) -> tuple[float, float]:
    """Height [m] and speed [m/s] at the begin of y (T,), from one swing of `known` frequency and decay."""
    t = np.arange(round(FPS / known.frequency)) / FPS
    omega = 2 * np.pi * known.frequency
    envelope = np.exp(-known.decay * t)
    basis = np.stack([envelope * np.cos(omega * t), envelope * np.sin(omega * t)], 1)
    a, b = np.linalg.lstsq(basis, y[: len(t)], rcond=None)[0].tolist()
    return a, omega * b - known.decay * a


def recorded(folder: Path) -> dict:
    """What the recordings alone say: decay over amplitude, and over frequency with 52 g hung on the end."""
    windows = {}
    for k in "ab":
        y = above_rest(take(folder / f"beam_gravity_V2_{k}.c3d"))
        length = SWINGS / FREQUENCY
        several = [read(y, FREQUENCY, b, b + length, (1.0,)) for b in BEGIN + length * np.arange(4)]
        windows[k] = [{"amplitude": r.amplitude, "frequency": r.frequency, "decay": r.decay} for r in several]
    modes = {}
    for name, guess in (("gravity", FREQUENCY), ("load52", LOADED)):
        for k in "ab":
            r = read(above_rest(take(folder / f"beam_{name}_V2_{k}.c3d")), guess)
            modes[f"{name} {k}"] = {"frequency": r.frequency, "decay": r.decay, "loss": r.loss}
    return {"swings": SWINGS, "windows": windows, "modes": modes}


def study(recording, values: dict, spacing: float, nu: float, progress, held: float | None = None) -> dict:
    """The beam with E and eta kept, on another grid, with another nu or with its end held as for another nu."""
    progress(0, 1, f"grid {1000 * spacing:g} mm, nu {nu:g}")
    run = swing(recording, **(values | {"nu": nu}), spacing=spacing, seconds=SHORT, held_nu=held)
    r = read(run.y, FREQUENCY, BEGIN, SHORT - 0.05)
    found = {"frequency": r.frequency, "decay": r.decay, "drop": run.drop}
    return {"spacing": spacing, "nu": nu, "held_nu": held or nu, "steps_per_second": run.per_frame * FPS} | found


def read(y: np.ndarray, frequency: float, begin: float = BEGIN, end: float = END, taus: tuple[float, ...] = CREEP):
    return ringing(y, FPS, begin=begin, end=end, frequency=frequency, taus=taus)


def above_rest(recording) -> np.ndarray:
    """Height of the free end above where it is in the last half second [m], (T,)."""
    y = tip(recording.points.astype(float))
    return y - y[-50:].mean()


def held(recording) -> float:
    """How far the held end fell in all [m]."""
    return float(above_rest(recording)[0])
