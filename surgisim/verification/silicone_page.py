"""Picture and words of the silicone beam's case."""

import numpy as np

from surgisim.verification.drawing import COLORS, legend, panels
from surgisim.verification.markdown import table
from surgisim.verification.silicone_take import FPS, MAKERS_DROP, MAKERS_E


def draw(result: dict):
    figure, axes = panels(4)
    figure.set_size_inches(9.6, 7.0)
    for ax, place in zip(axes, figure.add_gridspec(2, 2), strict=True):
        ax.set_subplotspec(place)
    _draw_straight(axes[0], result["traces"]["a"])
    for ax, k, told in ((axes[1], "a", "fitted"), (axes[2], "b", "predicted")):
        trace = result["traces"][k]
        t = (np.arange(len(trace["simulated"])) + trace["low"]) / FPS
        ax.plot(t, 1000 * np.array(trace["swings"]), ".", color=COLORS[0], markersize=3, label="recorded")
        ax.plot(t, 1000 * np.array(trace["simulated"]), color=COLORS[1], linewidth=1, label="simulated")
        ax.set(xlabel="time after release [s]", ylabel="above midline [mm]", title=f"Take {k}: {told}", xlim=(0, 1.9))
        legend(ax)
    _draw_modes(axes[3], result["recorded"]["modes"])
    return figure


def _draw_straight(ax, trace: dict) -> None:
    y, made = (1000 * np.array(trace[name]) for name in ("recorded", "straight"))
    t = np.arange(len(y)) / FPS
    ax.plot(t, y, ".", color=COLORS[0], markersize=3, label="recorded")
    # The engine lets go at once, whoever held the beam did not: both pass their rest together.
    late = _passes(y) - _passes(made)
    ax.plot((np.arange(len(made)) + late) / FPS, made, color=COLORS[1], linewidth=1, label="simulated, let go at once")
    ax.set(xlabel="time after release [s]", ylabel="above rest [mm]", title="Take a: from the straight beam")
    ax.set_xlim(0, 1.9)
    legend(ax)


def _passes(y: np.ndarray) -> float:
    """Frame, with its fraction, in which y first falls through zero."""
    after = int(np.flatnonzero(np.asarray(y) < 0)[0])
    return after - y[after] / (y[after] - y[after - 1])


def _draw_modes(ax, modes: dict) -> None:
    f, decay = (np.array([m[name] for m in modes.values()]) for name in ("frequency", "decay"))
    ax.loglog(f, decay, "o", color=COLORS[0], label="recorded: bare beam, with 52 g")
    line = np.array([4.0, 8.5])
    first = modes["gravity a"]
    ax.loglog(
        line, first["decay"] * (line / first["frequency"]) ** 2, color=COLORS[1], label="Kelvin-Voigt from take a"
    )
    ax.loglog(
        line, first["decay"] * line / first["frequency"], "--", color=COLORS[2], label="same loss at any frequency"
    )
    ax.set(xlabel="frequency [Hz]", ylabel="decay [1/s]", title="Decay against frequency")
    ax.set_xticks([4, 5, 6, 7, 8], ["4", "5", "6", "7", "8"])
    ax.set_yticks([0.7, 1, 1.5, 2, 3], ["0.7", "1", "1.5", "2", "3"])
    ax.minorticks_off()
    legend(ax)


def words(result: dict) -> str:
    values, takes = result["values"], result["takes"]
    rows = [
        [
            f"{k} ({told})",
            *(f"{r[n]:.3f}" for n in ("frequency", "decay")),
            *(f"{r['simulated'][n]:.3f}" for n in ("frequency", "decay")),
            *(f"{100 * r[n]:+.1f} %" for n in ("frequency_error", "decay_error")),
            f"{1000 * r['apart']:.2f} of {1000 * r['motion']:.2f}",
        ]
        for (k, r), told in zip(takes.items(), ("fitted", "predicted"), strict=True)
    ]
    head = ["take", "f [Hz]", "decay [1/s]", "simulated f", "decay", "error of f", "of decay", "RMS apart [mm]"]
    modes = result["recorded"]["modes"]
    first = modes["gravity a"]
    expected = {n: first["decay"] * (m["frequency"] / first["frequency"]) ** 2 for n, m in modes.items()}
    loss = [
        [n, f"{m['frequency']:.2f}", f"{m['decay']:.2f}", f"{expected[n]:.2f}", f"{m['loss']:.3f}"]
        for n, m in modes.items()
    ]
    windows = [
        [k, f"{1000 * w['amplitude']:.2f}", f"{w['frequency']:.2f}", f"{w['decay']:.2f}"]
        for k, several in result["recorded"]["windows"].items()
        for w in several
    ]
    grids, nu = ([_studied(r) for r in result[name]] for name in ("grids", "nu"))
    studied = ["grid [mm]", "nu", "held as for nu", "f [Hz]", "decay [1/s]", "drop [mm]", "steps per second"]
    several = result["recorded"]["swings"]
    drop, fell = 1000 * result["drop"]["simulated"], {k: 1000 * v for k, v in result["drop"]["held"].items()}
    softer = values["E"] * drop / np.mean(list(fell.values()))
    scaled = drop * values["E"] / MAKERS_E
    return f"""
A silicone beam (30 x 30 x 100 mm, clamped at one end) is held straight and let go; three markers ride on its free end
(motion capture, 100 Hz). On a grid of {1000 * result["spacing"]:g} mm, E {values["E"] / 1000:.0f} kPa and eta
{values["eta"]:.0f} Pa s (fixed corotated + Newtonian, nu {values["nu"]}) give take a's frequency and decay; take b is
predicted with them. Both are read from 1.5 s of swings about the creeping midline, begun at the first low point with
the height and the speed that the take's first swing has there.

{table(head, rows)}
What does not hold:

- **The decay does not follow Kelvin-Voigt over frequency.** With 52 g hung on its end the same beam rings slower and,
  by Kelvin-Voigt, would ring longer than it does; the share of energy lost in a swing is the same within the scatter.
  One eta fits one frequency. (Recorded only: the weight also swings on its own, hence the scatter.)

{table(["take", "f [Hz]", "decay [1/s]", "Kelvin-Voigt from take a", "loss factor"], loss)}
- **The beam creeps.** The middle of the swings sinks by {1000 * takes["a"]["midline"]:.2f} and
  {1000 * takes["b"]["midline"]:.2f} mm after the release; a Kelvin-Voigt solid swings about where it ends. For the same
  reason the modulus of the ringing is above that of the rest: from the straight beam down to rest the takes fall
  {fell["a"]:.2f} and {fell["b"]:.2f} mm, the simulation {drop:.2f} mm, so the rest alone would ask for
  {softer / 1000:.0f} kPa (the makers' {MAKERS_E / 1000:.0f} kPa).
- **The release takes time.** Let go at once, the simulated beam overshoots more than the recorded one (upper left); the
  holder brakes it for the first hundredths of a second, differently in a and b.
- **The envelope is not quite exponential.** Taken {several} swings at a time, the decay begins a tenth above its mean,
  then falls a tenth and more below it, then levels, in both takes alike. That is no law of amplitude; whether a second
  vibration beats with the first cannot be told here. The frequency rises by one per cent as the swings get small.

{table(["take", "amplitude [mm]", "f [Hz]", "decay [1/s]"], windows)}
Other grids, E and eta kept. The held end is one layer of particles on springs; how far in it lies and how it falls
into the cells moves the frequency by about a per cent, so E is E on its grid:

{table(studied, grids)}
nu is {values["nu"]} here and 0.499 for the makers, which would take 6.6 times as many steps (the root of
(1 - nu) / ((1 + nu) (1 - 2 nu)); 2 times for 0.49). Bending itself hardly asks for nu: with the end held by the same
springs the frequency changes little. But the engine's springs follow the pressure wave's modulus lambda + 2 mu and
soften with it, which at a coarse grid is the larger effect:

{table(studied, nu)}
The makers' COMSOL model falls {1000 * MAKERS_DROP:.2f} mm with E {MAKERS_E / 1000:.0f} kPa and nu 0.499; this
one, scaled to that E, {scaled:.2f} mm; its held layer shortens it."""


def _studied(row: dict) -> list[str]:
    told = [f"{1000 * row['spacing']:g}", f"{row['nu']:.2f}", f"{row['held_nu']:.2f}"]
    told += [f"{row['frequency']:.3f}", f"{row['decay']:.2f}"]
    return [*told, f"{1000 * row['drop']:.2f}", f"{row['steps_per_second']:.0f}"]
