"""The thick body from where no camera was, with millimetres along its sides."""

import numpy as np

from surgisim.report.charts.paper import photograph, sheet
from surgisim.report.palette import GRIP
from surgisim.report.views import View, surface


def particles(
    points: np.ndarray,
    color: np.ndarray,
    faces: np.ndarray,
    view: View,
    *,
    across: str,
    down: str,
    grips: tuple[tuple[np.ndarray, float], ...] = (),
    bar: tuple[str, float, float, str] | None = None,
) -> str:
    """Triangles (F, 3) between points [m], (Q, 3), in colours 0-255; `grips` (centre [m], radius [m]) as circles.

    `across` and `down` name the axes with their unit; `bar` adds a colour bar: map, low, high, label.
    """
    picture = surface(points, faces, color, view)
    inches = 3.2
    height = inches * view.height / view.width
    with sheet(inches + 0.6, height + 0.5 + (0.5 if bar else 0)) as figure:
        axes = figure.subplots()
        axes.grid(False)
        for side in ("top", "right"):
            axes.spines[side].set_visible(True)
        low, high = 1e3 * view.low, 1e3 * view.high
        axes.imshow(picture, extent=(low[0], high[0], high[1], low[1]), interpolation="none")
        for center, size in grips:
            where = 1e3 * np.array([center @ view.right, center @ view.down])
            turn = np.linspace(0, 2 * np.pi, 73)
            ring = where[:, None] + 1e3 * size * np.stack([np.cos(turn), np.sin(turn)])
            axes.plot(*ring, color="white", lw=3)
            axes.plot(*ring, color=GRIP, lw=1.5)
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(high[1], low[1])
        axes.set_xlabel(across)
        axes.set_ylabel(down)
        axes.set_anchor("N")
        if bar:
            from matplotlib.cm import ScalarMappable
            from matplotlib.colors import Normalize
            from matplotlib.ticker import MaxNLocator

            name, least, most, label = bar
            scale = ScalarMappable(Normalize(least, most), name)
            figure.colorbar(
                scale, ax=axes, orientation="horizontal", label=label, aspect=40, pad=0.02
            ).locator = MaxNLocator(5)
        return photograph(figure)
