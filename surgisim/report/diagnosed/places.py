"""The mismatch and its cause on the body, seen from several sides."""

from dataclasses import dataclass

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.ticker import MaxNLocator

from surgisim.report.charts.paper import photograph, sheet
from surgisim.report.diagnosed.case import Diagnosed
from surgisim.report.palette import ERROR, GRIP, INK, mapped
from surgisim.report.views import View, balls

SIZE = (760, 560)
PALE = np.array([226.0, 230.0, 234.0])
CAUSE = "YlOrRd"
WARM = 0.3
"""Share of the greatest cause from which tissue is shown as if the rest were glass."""


@dataclass(frozen=True)
class Panel:
    title: str
    picture: np.ndarray
    view: View
    across: str
    down: str
    rings: tuple[tuple[np.ndarray, float, str], ...] = ()
    """Centre [m], radius [m], colour."""
    arrow: tuple[np.ndarray, np.ndarray] | None = None
    """From here [m], by this much [m]."""


def mismatch(case: Diagnosed) -> str:
    """RMS over time at each tracked point, before and after, from above."""
    view, names = views(case)["above"]
    levels = [1e3 * _rms(r) for r in (case.mismatch.residual_before, case.mismatch.residual_after)]
    top = float(np.nanmax(levels[0], initial=0.0)) or 1e-6
    panels = [
        Panel(title, _dots(case, mapped(level, 0, top, ERROR), view), view, *names, _grips(case))
        for title, level in zip(("base law", "named law added"), levels, strict=True)
    ]
    if not case.verdict.names:
        panels = [Panel("base law", panels[0].picture, view, *names, _grips(case))]
    return _drawn(panels, (ERROR, 0, top, "recorded minus simulated, RMS over time [mm]"))


def cause(case: Diagnosed) -> str | None:
    """Where the body would have to act, through glass: from above, obliquely, from the side."""
    level = np.nan_to_num(np.abs(case.mismatch.cause))
    top = float(level.max(initial=0.0))
    if top <= 0:
        return None
    color = mapped(level, 0, top, CAUSE).astype(float)
    warm = level >= WARM * top
    panels = []
    for name, title in (("above", "from above"), ("oblique", "from half above"), ("side", "from the side")):
        view, names = views(case)[name]
        panels.append(Panel(title, _glass(case, color, warm, view), view, *names, _named(case)))
    return _drawn(panels, (CAUSE, 0, top, "how much of the symptom this tissue could cause [relative]"))


def symptom(case: Diagnosed) -> str:
    """The whitened residual at each point, from above, beside the cause from above."""
    view, names = views(case)["above"]
    z = np.sqrt(np.nanmean(np.where(np.isfinite(case.mismatch.z), case.mismatch.z, np.nan) ** 2, axis=1))
    top = max(float(np.nanmax(z, initial=0.0)), 2.0)
    panel = Panel("from above", _dots(case, mapped(z, 0, top, "viridis"), view), view, *names, _grips(case))
    return _drawn([panel], ("viridis", 0, top, "standard deviations, RMS over time [1]"))


def experiment(case: Diagnosed) -> str | None:
    """Where to take hold and which way to pull."""
    if not case.experiment:
        return None
    center, pull = (np.array(case.experiment[key], float) for key in ("center", "pull"))
    panels = []
    for name, title in (("above", "from above"), ("side", "from the side")):
        view, names = views(case, (center + pull,))[name]
        picture = balls(case.mismatch.particles, np.tile(PALE, (len(case.mismatch.particles), 1)), _ball(case), view)
        panels.append(Panel(title, picture, view, *names, _named(case), (center, pull)))
    return _drawn(panels, None)


def views(case: Diagnosed, more: tuple[np.ndarray, ...] = ()) -> dict[str, tuple[View, tuple[str, str]]]:
    """Name -> look and what its axes are; the long side of the body runs to the right."""
    up = case.up
    flat = case.mismatch.particles - case.mismatch.particles.mean(0)
    flat = flat - (flat @ up)[:, None] * up
    _, _, axes = np.linalg.svd(flat, full_matrices=False)
    right = axes[0] - (axes[0] @ up) * up
    right = right / np.linalg.norm(right)
    # The first large component is positive, so that the same body is always seen the same way round.
    right = right * np.sign(right[np.argmax(np.abs(right))])
    tilt = np.radians(40)
    ways = {"above": -up, "side": np.cross(up, right), "oblique": 0}
    ways["oblique"] = np.cos(tilt) * ways["side"] - np.sin(tilt) * up
    labels = {"above": "across [mm]", "side": "up [mm]", "oblique": "across and up [mm]"}
    points = np.concatenate([case.mismatch.particles, case.mismatch.points, *(m[None] for m in more)])
    return {n: (_view(points, right, w, case), ("along [mm]", labels[n])) for n, w in ways.items()}


def _view(points: np.ndarray, right: np.ndarray, forward: np.ndarray, case: Diagnosed) -> View:
    down = np.cross(forward, right)
    flat = np.stack([points @ right, points @ down], -1)
    low, high = flat.min(0), flat.max(0)
    pixel = 1.12 * float(((high - low) / SIZE).max())
    middle, half = (low + high) / 2, pixel * np.array(SIZE) / 2
    # Only as high as the body is: a thin one leaves no empty paper.
    half[1] = min(half[1], 0.6 * float(high[1] - low[1]) + 0.06 * float(high[0] - low[0]))
    return View(right, down, middle - half, middle + half, SIZE[0], round(SIZE[0] * half[1] / half[0]))


def _dots(case: Diagnosed, color: np.ndarray, view: View) -> np.ndarray:
    """Tracked points in colour on a pale body."""
    body, ball = case.mismatch.particles, _ball(case)
    points = case.mismatch.points
    picture = balls(body, np.tile(PALE, (len(body), 1)), ball, view)
    return _over(picture, balls(points, color.astype(float), 0.7 * ball, view))


def _glass(case: Diagnosed, color: np.ndarray, warm: np.ndarray, view: View) -> np.ndarray:
    body = case.mismatch.particles
    picture = balls(body, np.tile(PALE, (len(body), 1)), _ball(case), view)
    return _over(picture, balls(body[warm], color[warm], 0.8 * _ball(case), view)) if warm.any() else picture


def _over(picture: np.ndarray, painted: np.ndarray) -> np.ndarray:
    return np.where((painted < 255).any(-1, keepdims=True), painted, picture)


def _ball(case: Diagnosed) -> float:
    """Radius of a particle [m]: they just touch."""
    body = case.mismatch.particles
    away = np.linalg.norm(body[: min(len(body), 400), None] - body[None], axis=-1)
    away[away == 0] = np.inf
    return 0.8 * float(np.median(away.min(1)))


def _grips(case: Diagnosed) -> tuple[tuple[np.ndarray, float, str], ...]:
    motion = case.recording.motion
    return tuple((c, r, GRIP) for c, r in zip(motion.center_rest, motion.radius, strict=True))


def _named(case: Diagnosed) -> tuple[tuple[np.ndarray, float, str], ...]:
    places = [(np.array(e.center), e.extent or 2 * _ball(case), INK) for e in case.verdict.effects if e.center]
    return (*_grips(case), *places)


def _rms(residual: np.ndarray) -> np.ndarray:
    """RMS length over time of each point [m], (K,)."""
    square = (residual**2).sum(-1)
    seen = np.isfinite(square)
    return np.sqrt(np.where(seen, square, 0).sum(1) / np.maximum(seen.sum(1), 1))


def _drawn(panels: list[Panel], bar: tuple[str, float, float, str] | None) -> str:
    inches = 3.7
    ratio = max(p.view.height / p.view.width for p in panels)
    with sheet(inches * len(panels) + 0.5, inches * ratio + 0.65 + (0.5 if bar else 0)) as figure:
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
    view = panel.view
    axes.grid(False)
    for side in ("top", "right"):
        axes.spines[side].set_visible(True)
    middle = (view.low + view.high) / 2
    low, high = 1e3 * (view.low - middle), 1e3 * (view.high - middle)

    def flat(point):
        return 1e3 * (np.array([point @ view.right, point @ view.down]) - middle)

    # Up is positive, though pictures count downwards.
    axes.imshow(panel.picture, extent=(low[0], high[0], -high[1], -low[1]), interpolation="none")
    turn = np.linspace(0, 2 * np.pi, 73)
    for center, radius, color in panel.rings:
        x, y = flat(center)
        ring = np.array([[x], [-y]]) + 1e3 * radius * np.stack([np.cos(turn), np.sin(turn)])
        axes.plot(*ring, color="white", lw=3)
        axes.plot(*ring, color=color, lw=1.5)
    if panel.arrow is not None:
        x, y = flat(panel.arrow[0])
        to, down = flat(panel.arrow[0] + panel.arrow[1])
        axes.annotate("", (to, -down), (x, -y), arrowprops={"arrowstyle": "-|>", "lw": 2.2, "color": GRIP})
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(-high[1], -low[1])
    axes.set_title(panel.title, fontsize=8.5, color=INK)
    axes.set_xlabel(panel.across)
    axes.set_ylabel(panel.down)
    axes.set_anchor("N")
