"""Several runs and several diagnoses on one page small enough to publish."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from surgisim.artifacts.fit import Fit
from surgisim.artifacts.metrics import Metrics
from surgisim.artifacts.physics import Physics
from surgisim.problem import Problem
from surgisim.report.diagnosed import places
from surgisim.report.diagnosed.case import read
from surgisim.report.diagnosed.page import BADGE, cards, title
from surgisim.report.digits import shown
from surgisim.report.headline import Card
from surgisim.report.made import Made
from surgisim.report.page import template
from surgisim.report.parameters import Parameter, parameters
from surgisim.report.uri import data_uri

PICTURES = {
    "moving": ("image/webp", "Recording, and to its right the replay by the fitted body, without the instrument."),
    "still": ("image/jpeg", "The scene of Gaussians from the camera, and from 35° to the left."),
    "fitted": (
        "image/jpeg",
        "The fitted body, held tissue pink; cut open at the grip where it has moved farthest, yellow.",
    ),
}
"""Of a run: kind of file, and what it shows."""
ERRORS = {
    "tracked_held_out_moving_px": "replay off tracked points that move, frames held out",
    "tracked_held_out_moving_still_px": "a body that stands still, the same points and frames",
    "psnr_between": "replay, PSNR, frames held out between",
}
"""Numbers of a run that are shown, of the group `simulation`."""


@dataclass(frozen=True)
class Run:
    name: str
    pictures: list[tuple[str, str]]
    """Address and caption."""
    parameters: list[Parameter]
    numbers: list[tuple[str, str, str]]
    """What, value with unit, protocol."""


@dataclass(frozen=True)
class Opened:
    """A diagnosis, and what was concealed from it."""

    title: str
    badge: str
    verdict: str
    words: str
    concealed: str
    right: str
    """good, poor or plain: whether what was said is so."""
    cards: list[Card]
    mismatch: str
    cause: str | None


def run(name: str, pictures: dict[str, bytes], physics: Physics, fit: Fit, metrics: Metrics) -> Run:
    """`pictures`: by the names of PICTURES."""
    rows = parameters(physics, fit, metrics.values.get("physics", {}))
    entries = metrics.values.get("simulation", {})
    numbers = [
        (text, f"{shown(entries[key]['value'])} {entries[key]['unit']}", entries[key]["protocol"])
        for key, text in ERRORS.items()
        if key in entries
    ]
    addresses = [(data_uri(pictures[key], kind), text) for key, (kind, text) in PICTURES.items()]
    return Run(name, addresses, [r for r in rows if "." in r.name and " " not in r.name], numbers)


def opened(recording: Path, diagnosis: Path, mismatch: Path, physics: Path, score: Path) -> Opened:
    """From a diagnosis's files and its score. Raises Problem for files that are not of one case."""
    case = read(recording, diagnosis, mismatch, physics)
    told = json.loads(score.read_text())
    if told["recording"] != case.verdict.recording:
        raise Problem(
            f"{score}: is of {told['recording']}, and {diagnosis} is of {case.verdict.recording}. "
            "Pass files of one case."
        )
    verdict = case.verdict
    return Opened(
        title(case), BADGE[verdict.verdict], verdict.verdict, verdict.words, _concealed(told), _right(told),
        cards(case), places.mismatch(case), places.cause(case) if verdict.verdict != "nothing detectable" else None,
    )  # fmt: skip


def _concealed(score: dict[str, Any]) -> str:
    names = [
        e["term"].replace("_", " ") + (", which no law of the catalogue describes" if e["outside_catalogue"] else "")
        for e in score["concealed"]
    ]
    return " and ".join(names) or "nothing"


def _right(score: dict[str, Any]) -> str:
    """Every name right and one for each law: good. A wrong name, or an alarm where nothing was: poor."""
    wrong = score["wrong_names"]
    if any(wrong) or (not score["concealed"] and score["verdict"] != "nothing detectable"):
        return "poor"
    silent = not score["concealed"] and score["verdict"] == "nothing detectable"
    return "good" if silent or (wrong and score["verdict"] == "named") else "plain"


def page(runs: Sequence[Run], diagnoses: Sequence[Opened], made: Made, most: int) -> bytes:
    """UTF-8, with every picture inside, at most `most` bytes. Raises Problem where it takes more."""
    text = template("gallery.html.j2").render(runs=runs, diagnoses=diagnoses, made=made)
    content = text.encode()
    if len(content) > most:
        raise Problem(
            f"gallery: the page takes {len(content)} bytes, and at most {most} are wanted. Show fewer clips or cases."
        )
    return content
