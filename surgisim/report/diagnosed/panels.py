"""Pictures of a body side by side, with axes in the recording's frame, rings, and the markers of the words."""

from dataclasses import dataclass

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.ticker import MaxNLocator

from surgisim.artifacts.verdict import Marker
from surgisim.report.charts.paper import photograph, sheet
from surgisim.report.diagnosed.sides import AXES, Side
from surgisim.report.palette import GRIP, INK

INCHES = 3.7
"""Width of a panel."""
LENGTHS = (1, 2, 5, 10, 20, 50, 100, 200, 500)
"""Of a scale [mm]."""


@dataclass(frozen=True)
class Panel:
    title: str
    picture: np.ndarray
    """(H, W, 3) uint8, as `side.view` shows it."""
    side: Side
    rings: tuple[tuple[np.ndarray, float, str], ...] = ()
    """Centre [m], radius [m], colour."""
    markers: tuple[Marker, ...] = ()
    arrow: tuple[np.ndarray, np.ndarray] | None = None
    """From here [m], by this much [m]."""


def drawn(panels: list[Panel], bar: tuple[str, float, float, str] | None) -> str:
    """The panels in a row; bar: colour map, its ends, and what it means."""
    ratio = max(p.side.view.height / p.side.view.width for p in panels)
    with sheet(INCHES * len(panels) + 0.5, INCHES * ratio + 0.65 + (0.5 if bar else 0)) as figure:
        grid = figure.subplots(1, len(panels), squeeze=False)[0]
        for axes, panel in zip(grid, panels, strict=True):
            _panel(axes, panel)
        if bar:
            name, least, most, label = bar
            scale = ScalarMappable(Normalize(least, most), name)
            figure.colorbar(
                scale, ax=grid, orientation="horizontal", label=label, aspect=60, pad=0.02, shrink=0.6
            ).locator = MaxNLocator(5)
        return photograph(figure, 160)


def _panel(axes, panel: Panel) -> None:
    view = panel.side.view
    axes.grid(False)
    for side in ("top", "right"):
        axes.spines[side].set_visible(True)

    def flat(point) -> np.ndarray:
        """Where a point is drawn [mm]: up is positive, though pictures count downwards."""
        return 1e3 * np.array([point @ view.right, -(point @ view.down)])

    (left, top), (right, bottom) = (1e3 * edge * (1, -1) for edge in (view.low, view.high))
    axes.imshow(panel.picture, extent=(left, right, bottom, top), interpolation="none")
    turn = np.linspace(0, 2 * np.pi, 73)
    marked = [(m.center, m.extent, INK) for m in panel.markers if m.extent]
    for center, radius, color in (*panel.rings, *marked):
        ring = flat(np.array(center))[:, None] + 1e3 * radius * np.stack([np.cos(turn), np.sin(turn)])
        axes.plot(*ring, color="white", lw=3)
        axes.plot(*ring, color=color, lw=1.5)
    if panel.arrow is not None:
        begin, end = flat(panel.arrow[0]), flat(panel.arrow[0] + panel.arrow[1])
        axes.annotate("", end, begin, arrowprops={"arrowstyle": "-|>", "lw": 2.2, "color": GRIP})
    for marker in panel.markers:
        _badge(axes, marker, flat(np.array(marker.center)))
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    axes.set_title(panel.title, fontsize=8.5, color=INK)
    if panel.side.axes is None:
        axes.set_xticks([])
        axes.set_yticks([])
        _compass(axes, view)
    else:
        across, upward, sign = panel.side.axes
        axes.set_xlabel(f"{across} [mm]")
        axes.set_ylabel(f"{upward} [mm]")
        axes.yaxis.set_major_formatter(lambda value, _: f"{sign * value + 0.0:g}".replace("-", "\N{MINUS SIGN}"))
    _scale(axes, right - left)
    axes.set_anchor("N")


def _badge(axes, marker: Marker, at: np.ndarray) -> None:
    """The number of an effect to the right of its ring, the letter of anything else to the left of its point."""
    numbered = marker.mark.isdigit()
    turn = np.radians(45 - 45 * (int(marker.mark) - 1) if numbered else 135 + 45 * (ord(marker.mark[0]) - ord("A")))
    way = np.array([np.cos(turn), np.sin(turn)])
    axes.plot(*at, "+" if numbered else "x", color="white", ms=7, mew=3)
    axes.plot(*at, "+" if numbered else "x", color=INK, ms=6, mew=1.3)
    axes.annotate(
        marker.mark,
        at + 1e3 * (marker.extent or 0.0) * way,
        13 * way,
        textcoords="offset points",
        ha="center",
        va="center",
        fontsize=8,
        fontweight="bold",
        color="white" if numbered else INK,
        bbox={"boxstyle": "circle,pad=0.22", "fc": INK if numbered else "white", "ec": INK, "lw": 0.9},
        arrowprops={"arrowstyle": "-", "color": INK, "lw": 0.9, "shrinkA": 0, "shrinkB": 0},
        annotation_clip=False,
        zorder=6,
    )


def _scale(axes, width: float) -> None:
    """A bar of about a fifth of the width [mm] in the lower right corner."""
    length = max((each for each in LENGTHS if each <= 0.25 * width), default=LENGTHS[0])
    low, high = axes.get_ylim()
    right, y = axes.get_xlim()[1] - 0.03 * width, low + 0.02 * width + 0.01 * (high - low)
    axes.plot([right - length, right], [y, y], color=INK, lw=2.2, solid_capstyle="butt")
    axes.annotate(
        f"{length} mm",
        (right - length / 2, y),
        (0, 3),
        textcoords="offset points",
        ha="center",
        fontsize=7,
        color=INK,
        bbox={"fc": "white", "ec": "none", "alpha": 0.7, "pad": 0.6},
    )


def _compass(axes, view) -> None:
    """Which way the frame's axes point, where the picture's sides are none of them."""
    ways = np.stack([np.eye(3) @ view.right, -(np.eye(3) @ view.down)], -1)
    # In the lower left corner, however the arrows point.
    foot = 10 - 23 * np.minimum(ways.min(0), 0)
    for name, way in zip(AXES, ways, strict=True):
        axes.annotate(
            "", foot + 17 * way, foot, xycoords="axes points", textcoords="axes points",
            arrowprops={"arrowstyle": "-|>", "lw": 1.0, "color": INK, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 6},
        )  # fmt: skip
        axes.annotate(
            name, foot + 17 * way + 5 * way / np.linalg.norm(way), xycoords="axes points",
            ha="center", va="center", fontsize=7.5, color=INK,
        )  # fmt: skip
