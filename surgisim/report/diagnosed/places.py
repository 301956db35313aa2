"""The mismatch and its cause on the body, seen from several sides."""

import numpy as np

from surgisim.report.diagnosed.case import Diagnosed
from surgisim.report.diagnosed.panels import Panel, drawn
from surgisim.report.diagnosed.sides import sides
from surgisim.report.palette import ERROR, GRIP, mapped
from surgisim.report.views import View, balls

PALE = np.array([226.0, 230.0, 234.0])
CAUSE = "YlOrRd"
WARM = 0.3
"""Share of the greatest cause from which tissue is shown as if the rest were glass."""


def mismatch(case: Diagnosed) -> str:
    """RMS over time at each tracked point, before and after, from above."""
    side = sides(case)["above"]
    levels = [1e3 * _rms(r) for r in (case.mismatch.residual_before, case.mismatch.residual_after)]
    top = float(np.nanmax(levels[0], initial=0.0)) or 1e-6
    panels = [
        Panel(
            f"{law}, {side.title}", _dots(case, mapped(level, 0, top, ERROR), side.view), side, _grips(case), case.shown
        )
        for law, level in zip(("base law", "named law added"), levels, strict=True)
    ]
    if not case.verdict.names:
        panels = panels[:1]
    return drawn(panels, (ERROR, 0, top, "recorded minus simulated, RMS over time [mm]"))


def cause(case: Diagnosed) -> str | None:
    """Where the body would have to act, through glass: from above, obliquely, from the side."""
    level = np.nan_to_num(np.abs(case.mismatch.cause))
    top = float(level.max(initial=0.0))
    if top <= 0:
        return None
    color = mapped(level, 0, top, CAUSE).astype(float)
    warm = level >= WARM * top
    panels = []
    for side in sides(case).values():
        panels.append(Panel(side.title, _glass(case, color, warm, side.view), side, _grips(case), case.shown))
    return drawn(panels, (CAUSE, 0, top, "how much of the symptom this tissue could cause [relative]"))


def symptom(case: Diagnosed) -> str:
    """The whitened residual at each point, from above, beside the cause from above."""
    side = sides(case)["above"]
    z = np.sqrt(np.nanmean(np.where(np.isfinite(case.mismatch.z), case.mismatch.z, np.nan) ** 2, axis=1))
    top = max(float(np.nanmax(z, initial=0.0)), 2.0)
    picture = _dots(case, mapped(z, 0, top, "viridis"), side.view)
    panel = Panel(side.title, picture, side, _grips(case), case.shown)
    return drawn([panel], ("viridis", 0, top, "standard deviations, RMS over time [1]"))


def experiment(case: Diagnosed) -> str | None:
    """Where to take hold and which way to pull."""
    if not case.experiment:
        return None
    center, pull = (np.array(case.experiment[key], float) for key in ("center", "pull"))
    panels = []
    for name in ("above", "side"):
        side, body = sides(case, (center + pull,))[name], case.mismatch.particles
        picture = balls(body, np.tile(PALE, (len(body), 1)), _ball(case), side.view)
        panels.append(Panel(side.title, picture, side, _grips(case), case.markers, (center, pull)))
    return drawn(panels, None)


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


def _rms(residual: np.ndarray) -> np.ndarray:
    """RMS length over time of each point [m], (K,)."""
    square = (residual**2).sum(-1)
    seen = np.isfinite(square)
    return np.sqrt(np.where(seen, square, 0).sum(1) / np.maximum(seen.sum(1), 1))
