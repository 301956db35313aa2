"""Two plain sentences for a verdict."""

from collections.abc import Sequence

from surgisim.artifacts.verdict import LARGEST
from surgisim.diagnosis import candidates
from surgisim.diagnosis.hypothesis import Hypothesis

READ_IN = {"1": (1.0, ""), "kg": (1e3, " g")}
"""Units that nobody reads a tissue's numbers in, and what is written instead."""


def sentence(found: Sequence[tuple[Hypothesis, dict[str, dict], float]], gained: float) -> str:
    """What is seen, and what naming it gains; found: laws, their parameters, and their sizes [m]."""
    told = [(*_told(h, parameters, number), 1e3 * size) for number, (h, parameters, size) in enumerate(found, 1)]
    seen = ", and that ".join(f"{what} ({size:.2g} mm RMS)" for what, _, size in told)
    added = " and ".join(law for _, law, _ in told)
    removes = "removes" if len(told) == 1 else "together remove"
    return (
        f"Beside its simulation the recording shows that {seen}. "
        f"Adding {added} {removes} {100 * gained:.0f} % of the misfit that can be told from noise."
    )


def _told(h: Hypothesis, parameters: dict[str, dict], number: int) -> tuple[str, str]:
    """What a law makes tissue do, and what it is; number: its marker's."""
    law = candidates.of(h)
    amount = ""
    if parameters:
        name, first = next(iter(parameters.items()))
        times, unit = READ_IN.get(first["unit"], (1.0, f" {first['unit']}"))
        value, low, high = (times * first[key] for key in ("value", "low", "high"))
        amount = f"{name} = {value:.3g}{unit}, {low:.3g} to {high:.3g}"
    softer = "s" in parameters and parameters["s"]["value"] < 1
    said = law.seen.format(
        where=_where(h, number), onset=_moment(h.onset), end=_moment(h.end), less="more" if softer else "less",
    ).replace("  ", " ")  # fmt: skip
    return said, law.added.format(amount=amount)


def instead(others: Sequence[tuple[str, float]]) -> str:
    """others: laws that it may be as well, with their probabilities."""
    told = " or ".join(f"{term} (probability {chance:.2f})" for term, chance in others)
    return f" It may be {told} instead: this recording does not tell them apart."


def guessed(above: float) -> str:
    """Of a video, where no law says most of what is there."""
    return (
        "Simulation and recording differ by no more than noise, camera, discretisation and a body guessed from one "
        "view explain: no law takes away half of what a smooth motion could and is borne out by the "
        "plain error. Effects above "
        f"{1e3 * above:.2g} mm RMS would have been seen on a known body."
    )


def nothing(above: float, later: tuple[float, float] | None = None) -> str:
    """later: misfit and noise of the frames held out [mm], where the misfit stands out."""
    seen = f"Effects above {1e3 * above:.2g} mm RMS would mostly have been seen"
    if later is None:
        return f"Simulation and recording differ by no more than noise, camera and discretisation explain. {seen}."
    return (
        "In the fitted frames simulation and recording differ by no more than noise, camera and discretisation "
        f"explain; in those held out by {later[0]:.2g} mm RMS, where noise makes {later[1]:.2g}. "
        f"{seen} in the fitted ones: to have the later ones searched, hold out fewer (split.json)."
    )


WHY = {
    "little": "it leaves {left:.0f} % of what any smooth motion could explain: what is missing is not in the "
    "catalogue, or more than one thing",
    "loose": "a push follows whatever comes and goes, and this one leaves {left:.0f} % of what any smooth motion "
    "could explain: what is missing is another thing",
    "ungrasped": "no grip was found in the video, so that nothing pulls the simulated tissue: mark it "
    "(docs/grasps.md) before anything is read from what is left",
    "unbacked": "the plain error of the fitted frames does not fall by what it changes: noise and camera may not be "
    "quite what they are taken for",
    "unfit": "beside it the frames held out stay off by much more than noise: what is missing is not in the catalogue, "
    "or more than one thing",
    "refuted": "the frames held out are farther off with it than without",
    "beaten": "the same law at a wrong place, or a wrong law, foretells the frames held out better",
    "unconfirmed": "this recording cannot confirm it (probability {chance:.2f}): another pull, held and released "
    "where it shows, would",
}
"""Why what comes nearest is not named."""


def unbelieved(reason: str, best: str, chance: float, left: float, when: str, where: list[float]) -> str:
    """For a law that comes nearest and is not named; left: share that a smooth field could still explain."""
    comes = "is supported" if reason == "unconfirmed" else "comes nearest"
    return (
        f"The recording departs from its simulation, most of all {_at(LARGEST, where)} {when}, and {best} {comes}. "
        f"It is not named, because {WHY[reason].format(left=100 * left, chance=chance)}."
    )


def beside(told: Sequence[str]) -> str:
    """Sentences that follow a verdict's own."""
    return "".join(f" {sentence}" for sentence in told)


def drawn(h: Hypothesis, number: int = 1) -> str:
    """h: a push that points out of the tissue; number: its marker's."""
    return (
        f"Something unseen draws the tissue out of its surface {_at(number, h.place.center)} from {_moment(h.onset)} "
        f"to {_moment(h.end)}; a contact could only press on it, and no law of the catalogue does that. "
        "A second grip or a stitch that was not recorded would; mark it as a grip and diagnose again."
    )


def _where(h: Hypothesis, mark: int) -> str:
    if h.place is None:
        return ""
    return _at(mark, h.place.center) if h.place.normal is None else f"in the layer beyond {_place(h.place.center)}"


def _at(mark: int | str, where: Sequence[float]) -> str:
    """A place by its marker and where it is in the recording's frame; where: [m]."""
    return f"at {mark} {_place(where)}"


def _place(where: Sequence[float]) -> str:
    return f"({', '.join(f'{1e3 * c:.0f}' for c in where)} mm)"


def _moment(seconds: float | None) -> str:
    return "the end" if seconds is None else f"{seconds:.2g} s"
