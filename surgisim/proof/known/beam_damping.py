"""A silicone beam let go under gravity rings down in two seconds; an elastic beam never stops.

The base may be elastic only. Take a is diagnosed; with the laws it names, frequency and decay of take b must come out.
"""

from pathlib import Path

from surgisim.proof.known.catalogue import Answer, Found, Known, named

FREQUENCY = 7.6
"""First guess [Hz]."""
DAMPS = ("newtonian", "relaxation", "relaxation_slow", "drag", "paper_viscous")


def convert(folder: Path):
    from surgisim.proof.recorded.clamped_beam import carried

    return carried(folder / "beam_gravity_V2_a.c3d")


def hold_out(folder: Path):
    from surgisim.proof.recorded.clamped_beam import carried

    return carried(folder / "beam_gravity_V2_b.c3d", "take-b")


def ask(folder: Path, found: Found) -> list[Answer]:
    from surgisim.proof.recorded.clamped_beam import simulated, swings

    answers = [named(found.verdict, DAMPS, "damping, by any law that loses energy")]
    if not set(found.verdict.names) & set(DAMPS):
        return answers
    other = folder / "beam_gravity_V2_b.c3d"
    real, made = swings(other, FREQUENCY), simulated(other, found.physics, FREQUENCY)
    for name, limit, unit in (("frequency", 0.03, "Hz"), ("decay", 0.15, "1/s")):
        true, got = getattr(real, name), getattr(made, name)
        off = got / true - 1
        answers.append(
            Answer(
                f"{name} of take b, predicted",
                f"{true:.3g} {unit} within {100 * limit:.0f} %",
                f"{got:.3g} {unit} ({100 * off:+.1f} %)",
                abs(off) <= limit,
            )
        )
    return answers


KNOWN = Known(
    title="Silicone beam, its damping concealed",
    data="silicone_beam_mocap",
    concealed="The base beam is elastic and never comes to rest. The recorded one rings at 7.7 Hz and rests in 2 s.",
    convert=convert,
    hold_out=hold_out,
    ask=ask,
    # Three cells across the beam.
    settings={"base": "elastic", "grid": 0.23},
)
