"""What holds across families of generators, as one HTML file."""

from typing import Any

from surgisim.report.board.page import told
from surgisim.report.charts.compare import compare
from surgisim.report.digits import shown
from surgisim.report.made import Made
from surgisim.report.page import template

ROWS = {
    "top1": "named rightly, one law concealed",
    "ranked_first": "ranked first",
    "wrong_names": "names that are wrong",
    "false_discovery": "something named where nothing is concealed",
    "alarm": "alarms where nothing is concealed",
    "held_back": "outside the catalogue: held back",
    "place_right": "placed within 1.5 grid cells",
    "parameter_covered": "law's numbers inside their 90 % intervals",
    "cut_effect": "held-out error: cut of what the effect adds, median",
}


def page(found: dict[str, Any], made: Made) -> bytes:
    """UTF-8, with every picture inside."""
    pictures = {
        words: compare(
            {
                row["family"]: {
                    way: 100 * row[key][name]["value"]
                    for way, key in (("as diagnosed", "plain"), ("learned of the others", "kept"))
                    if row[key][name]["value"] is not None
                }
                for row in found["families"]
            },
            ["as diagnosed", "learned of the others"],
        )
        for name, words in ROWS.items()
        if name in ("top1", "alarm")
    }
    text = template("across.html.j2").render(**found, rows=ROWS, told=told, shown=shown, made=made, pictures=pictures)
    return text.encode()
