"""Passive skeletal muscle pressed between plates and held, along its fibres and across them."""

from pathlib import Path

from surgisim.proof.known.catalogue import Answer, Found, Known


def direct(folder: Path, progress) -> Found:
    # Inside the functions, here and beside: the workflow lists these files at each start.
    from surgisim.proof.rigs.pressed_muscle import diagnose

    return diagnose(folder / "muscle_rate_vals.xls", progress)


def ask(folder: Path, found: Found) -> list[Answer]:
    from surgisim.proof.rigs.pressed_muscle import ask

    return ask(folder, found)


KNOWN = Known(
    title="Muscle pressed and held, its relaxation and its fibres concealed",
    data="tissue_mechanical_tests",
    concealed="The base is elastic and isotropic. The muscle loses a third of its stress or more in a hold of 300 s, "
    "and is about twice as stiff across its fibres.",
    direct=direct,
    ask=ask,
)
