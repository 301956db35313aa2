"""One sentence on what has no name, and one on whether it predicts."""

from surgisim.artifacts.character import Character
from surgisim.diagnosis.hypothesis import Hypothesis

NOTHING_PAYS = "No law without a name pays for its numbers either."
CHANGES = {
    "grows": "grows over {rise:.2g} s",
    "holds": "holds once it is there",
    "fades": "fades or ends again",
    None: "comes again every {period:.2g} s",
}
ENERGIES = {
    "gives": "does work on the tissue", "takes": "takes energy out of it", "neither": "gives back what it takes",
}  # fmt: skip


def sentence(h: Hypothesis, how: Character, numbers: int, held_out: dict, helps: bool) -> str:
    """h: the first law's hypothesis; numbers: how many were free; held_out: the errors there [mm]."""
    return f"{behaviour(h, how)} {gain(numbers, held_out, helps)}"


def behaviour(h: Hypothesis, how: Character) -> str:
    rest = {True: "acts at rest too", False: "acts only under load", None: "was there only while tissue was held"}
    if how.local:
        where = f"in one place ({', '.join(f'{1e3 * c:.0f}' for c in h.place.center)} mm)"
    else:
        where = "everywhere" if h.place is None else "in a layer"
    change = CHANGES[how.change].format(rise=h.about.get("rise", 0.0), period=how.period or 0.0)
    since = f" from {h.onset:.2g} s on" if h.onset is not None and h.onset > 0 else ""
    return f"What is missing {rest[how.at_rest]}, {where}{since}; it {change} and {ENERGIES[how.energy]}."


def gain(numbers: int, held_out: dict, helps: bool) -> str:
    before, after, floor = (held_out.get(key) for key in ("before", "after", "noise_floor"))
    if before is None or after is None:
        return "No frames are held out that could show whether a law without a name predicts; it is not modelled."
    if helps:
        return (
            f"As a law without a name, of {numbers} numbers, it is modelled: the error of the frames held out falls "
            f"from {before:.3g} to {after:.3g} mm RMS, where noise makes {floor:.3g}."
        )
    return (
        f"A law without a name, of {numbers} numbers, does not lower the error of the frames held out by more than its "
        f"interval ({before:.3g} mm RMS without, {after:.3g} with it), and is not modelled."
    )
