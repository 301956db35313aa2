"""Verdicts on perturbed recordings as a matrix: one HTML file, one picture, and lines for a terminal."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from surgisim.report.board.page import told
from surgisim.report.charts.paper import png, sheet
from surgisim.report.made import Made
from surgisim.report.page import template
from surgisim.report.palette import INK, REPLAY, TOOL

Found = dict[str, Any]
COLORS = {
    "silent": "#cfe8de",
    "right": TOOL,
    "withdrawn": "#dfe3e8",
    "alarm": "#f2c879",
    "wrong": REPLAY,
}
DARK = ("right", "wrong")
"""Colours on which letters are white."""
LEGEND = {
    "silent": "nothing concealed, nothing detectable",
    "right": "named rightly",
    "withdrawn": "no name",
    "alarm": "nothing concealed, unexplained",
    "wrong": "a law named that is not there",
}
SHORT = {"nothing detectable": "nothing", "unexplained": "unexplained"}
COLUMNS = {
    "silent": "nothing concealed: silent",
    "false_names": "nothing concealed: a name",
    "right": "named rightly",
    "withdrawn": "no name",
    "wrong": "another law",
    "wrong_sure": "another law, above 50 %",
    "kept": "name kept",
    "lost": "name withdrawn",
    "turned": "name turned",
    "turned_sure": "name turned, above 50 %",
}


def page(found: Found, before: Found | None, made: Made | None = None) -> bytes:
    """UTF-8; what was found before stands below and beside."""
    content = {"sets": sets(found, before), "colors": COLORS, "dark": DARK, "legend": LEGEND, "short": SHORT}
    return template("robustness.html.j2").render(**content, made=made, columns=COLUMNS, told=told).encode()


def picture(found: Found, before: Found | None) -> bytes:
    """The matrix as PNG, what was found before below it."""
    shown = sets(found, before)
    rows, columns = len(found["bodies"]), len(found["perturbations"])
    with sheet(2.6 + 0.62 * columns, len(shown) * (1.5 + 0.36 * rows)) as figure:
        for axes, (title, one) in zip(figure.subplots(len(shown), 1, squeeze=False)[:, 0], shown, strict=True):
            _matrix(axes, title if len(shown) > 1 else "", one)
        return png(figure)


def words(found: Found, before: Found | None) -> str:
    """Every share as text, both sets side by side."""
    lines = []
    for name in [*found["perturbations"], "all perturbed"]:
        for key, meaning in COLUMNS.items():
            sides = [told((one["figures"].get(name) or one["perturbed"])[key]) for _, one in sets(found, before)]
            if any(side != "–" for side in sides):
                lines.append(f"{name:<18}{meaning:<28}" + "  before: ".join(sides))
    return "\n".join(lines)


def sets(found: Found, before: Found | None) -> list[tuple[str, Found]]:
    return [("now", found)] + ([("before", before)] if before else [])


def _matrix(axes: Axes, title: str, found: Found) -> None:
    names, rows = found["perturbations"], found["bodies"]
    axes.grid(visible=False)
    for y, row in enumerate(rows):
        for x, name in enumerate(names):
            cell = row["cells"].get(name)
            if cell is None:
                continue
            axes.add_patch(_square(x, y, COLORS[cell["outcome"]]))
            said = f"{_law(cell['law'])}\n{cell['probability']:.2f}" if cell["law"] else SHORT[cell["verdict"]]
            color = "white" if cell["outcome"] in DARK else INK
            axes.text(x, y, said, ha="center", va="center", fontsize=5.2, color=color)
    concealed = [f"{r['body']}: {(r['concealed'] or 'nothing').replace('_', ' ')}" for r in rows]
    axes.set_yticks(range(len(rows)), concealed)
    axes.set_xticks(range(len(names)), [n.replace("_", " ") for n in names], rotation=60, ha="left")
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.set_xlim(-0.5, len(names) - 0.5)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.spines[:].set_visible(False)
    if title:
        axes.set_title(title, loc="left")


def _square(x: int, y: int, color: str) -> Rectangle:
    return Rectangle((x - 0.48, y - 0.46), 0.96, 0.92, color=color, lw=0)


def _law(name: str) -> str:
    return name.replace("_", "\n", 1).replace("_", " ")
