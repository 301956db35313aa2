"""The paper's tables as an HTML file, as Markdown and as rows of numbers."""

import csv
import io
import json
from collections.abc import Iterable
from typing import Any

import numpy as np
from PIL import Image

from surgisim.proof.tables import Cell, plain
from surgisim.report.digits import shown
from surgisim.report.made import Made
from surgisim.report.page import template
from surgisim.report.uri import jpeg


def page(found: dict[str, Any], pictures: Iterable[bytes] = (), made: Made | None = None) -> bytes:
    """UTF-8. pictures: PNG of scenes' surfaces, shown below the table of environments."""
    told = found | {"receipt": json.dumps(found["receipt"], indent=1, sort_keys=True)}
    # A photograph's format: splats by the thousand fill a megabyte each as PNG.
    opened = (Image.open(io.BytesIO(one), formats=["PNG"]) for one in pictures)
    told["pictures"] = [jpeg(np.asarray(picture.convert("RGB")), 80) for picture in opened]
    return template("tables.html.j2").render(**told, made=made, in_words=in_words).encode()


def as_csv(found: dict[str, Any]) -> bytes:
    """One row a number: table, row, column, value, low, high, whether it is the paper's."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["table", "row", "column", "value", "low", "high", "printed"])
    for table in found["tables"]:
        for printed in (False, True):
            for row in table["printed" if printed else "rows"]:
                for column, cell in zip(table["columns"], row["cells"], strict=False):
                    if cell["value"] is not None:
                        ends = ("" if cell[end] is None else f"{cell[end]:.6g}" for end in ("low", "high"))
                        value = f"{cell['value']:.6g}"
                        writer.writerow([table["name"], row["name"], column, value, *ends, "yes" if printed else "no"])
    return out.getvalue().encode()


def as_markdown(found: dict[str, Any]) -> bytes:
    """Every table with its protocol, for a README or a paper's appendix."""
    lines = []
    for table in found["tables"]:
        lines += [f"## {table['title']}", "", table["protocol"], ""]
        lines += ["| | " + " | ".join(table["columns"]) + " |", "|---" * (len(table["columns"]) + 1) + "|"]
        for row in table["rows"]:
            name = f"**{row['name']}**" if row["bold"] else row["name"]
            lines.append(f"| {name} | " + " | ".join(map(in_words, row["cells"])) + " |")
        for row in table["printed"]:
            cells = row["cells"] + [plain(None)] * (len(table["columns"]) - len(row["cells"]))
            lines.append(f"| *printed: {row['name']}* | " + " | ".join(map(in_words, cells)) + " |")
        lines += ["", *([table["words"], ""] if table["words"] else []), f"Printed: {table['printed_note']}.", ""]
    return ("\n".join(lines).rstrip() + "\n").encode()


def in_words(cell: Cell) -> str:
    """A number with its interval, where it has one."""
    if cell["value"] is None:
        return "–"
    ends = "" if cell["low"] is None else f" ({shown(cell['low'])} to {shown(cell['high'])})"
    return shown(cell["value"]) + ends
