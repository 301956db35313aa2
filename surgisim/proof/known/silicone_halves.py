"""A bar cast of two silicones, one half twice as stiff as the other, hangs out from a clamp."""

from pathlib import Path

import numpy as np

from surgisim.proof.known.catalogue import Answer, Found, Known, named

LUMPS = ("stiff_inclusion", "base_layer")
SEAM, APART, FACTOR = 0.015, 2.0, 0.44
"""How far the seam may be off [m], and by how much the factor; what the makers' own fits make of it: a shear modulus of
22.3 over one of 50.1 kPa (their h_e_c and h_m_c)."""


def convert(folder: Path):
    from surgisim.proof.recorded.hanging_beam import hanging

    with np.load(folder / "lidar_depth_targets_m_768x1024.npz") as pictures:
        depth = pictures["h_em_c"].astype(float)
    return hanging(depth, folder / "cantilever_f1494_v749.tet")


def ask(folder: Path, found: Found) -> list[Answer]:
    answers = [named(found.verdict, LUMPS, "tissue that is stiffer or softer somewhere")]
    lump = next((e for e in found.verdict.effects if e.term in LUMPS), None)
    if lump is None or not answers[0].met:
        return answers
    asked = "the half at the clamp (x > 0) is the softer"
    factor = lump.parameters.get("s", {}).get("value")
    if lump.center is None or factor is None:
        return [*answers, Answer("which half is soft", asked, "no place, or no factor, is given", False)]
    # A part is said to begin at a plane and to lie beyond it, a lump to lie about a point.
    normal = found.physics.get("places", {}).get(lump.term, {}).get("normal")
    at_clamp = (normal[0] if normal else lump.center[0]) > 0
    got = f"{'softer' if factor < 1 else 'stiffer'} by {factor:.2g} {'beyond' if normal else 'at'} "
    got += f"x = {1e3 * lump.center[0]:.0f} mm"
    half = Answer("which half is soft", asked, got, (factor < 1) == at_clamp)
    off = float(lump.center[0])
    seam = Answer(
        "where the seam is", f"x = 0, within {1e3 * SEAM:.0f} mm", f"x = {1e3 * off:.0f} mm", abs(off) <= SEAM
    )
    ratio = min(factor, 1 / factor)
    size = Answer(
        "how soft", f"{FACTOR} within a factor of {APART:.0f}", f"{ratio:.2g}",
        FACTOR / APART <= ratio <= FACTOR * APART,
    )  # fmt: skip
    return [*answers, half, *([seam] if normal else []), size]


KNOWN = Known(
    title="A bar of two silicones, its two halves concealed",
    data="diffcal_silicone",
    concealed="The base is one silicone. The bar is Ecoflex-50 at the clamp and MoldStar-15, twice as stiff, beyond.",
    convert=convert,
    ask=ask,
    # Two and a half cells across the bar.
    settings={"grid": 0.23},
)
