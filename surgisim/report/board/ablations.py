"""What each part of the method, and of the clip, is worth, as one HTML file."""

from typing import Any

from surgisim.report.board.page import told
from surgisim.report.digits import shown
from surgisim.report.made import Made
from surgisim.report.page import template

WORDS = {
    "main": "the method",
    "iid": "residuals taken as independent",
    "no_offset": "no reference offset of the points",
    "no_nulls": "no calibration on nulls",
    "no_model_error": "no error of the simulator itself",
    "no_cause_map": "local laws only where the misfit is largest",
    "until_load": "fitted until the load ends",
    "until_hold": "fitted until the hold ends",
    "shuffled": "another case's paths",
}


def page(found: dict[str, Any], made: Made | None = None) -> bytes:
    """UTF-8."""
    return (
        template("ablations.html.j2")
        .render(**found, made=made, told=told, shown=shown, words=WORDS, mark=mark)
        .encode()
    )


def mark(said: dict[str, Any]) -> str:
    """How a verdict's cell is coloured: alarms and wrong verdicts stand out."""
    if said["alarm"] or said["right"] is False:
        return "no"
    return "yes" if said["right"] else ""
