"""How well a diagnosis meets its recording, and what it fitted beside the tissue's physics, as far as it says so."""

from dataclasses import dataclass
from typing import Any

from surgisim.problem import Problem


@dataclass(frozen=True)
class Nuisance:
    """What is no physics of the tissue and was fitted beside it."""

    name: str
    value: float
    sd: float
    """Standard deviation of the value."""
    unit: str
    said: bool
    """Whether the recording says more of it than was assumed."""


@dataclass(frozen=True)
class Goodness:
    """How well the frames are met, noise and model error taken into account."""

    per_frame: tuple[float | None, ...]
    """Chi square over its degrees of freedom [1]."""
    degrees: tuple[float, ...] | None = None
    """Those degrees of freedom, of each frame."""


def nuisances(body: dict[str, Any], where: str) -> tuple[Nuisance, ...]:
    """Those of a diagnosis read from JSON; none where it says nothing of them."""
    return tuple(_nuisance(raw, f"{where}: nuisance {i}") for i, raw in enumerate(_told(body, "nuisances") or ()))


def _nuisance(raw: Any, where: str) -> Nuisance:
    if not isinstance(raw, dict) or not {"name", "value", "sd"} <= raw.keys():
        raise Problem(f"{where}: 'name', 'value' and 'sd' are wanted. Diagnose anew.")
    value, sd = float(raw["value"]), float(raw["sd"])
    return Nuisance(str(raw["name"]), value, sd, str(raw.get("unit", "1")), bool(raw.get("said", False)))


def goodness(body: dict[str, Any], where: str) -> Goodness | None:
    """From a list of one number a frame, or {"per_frame": that, "degrees": one number or one a frame}."""
    raw, where = _told(body, "goodness"), f"{where}: goodness"
    if not raw:
        return None
    raw = {"per_frame": raw} if isinstance(raw, list) else raw
    if not isinstance(raw, dict) or not isinstance(raw.get("per_frame"), list):
        raise Problem(f"{where}: a list of one number a frame is wanted under 'per_frame'. Diagnose anew.")
    frames = tuple(None if x is None else float(x) for x in raw["per_frame"])
    degrees = raw.get("degrees")
    if isinstance(degrees, int | float):
        degrees = [degrees] * len(frames)
    if degrees is not None and len(degrees) != len(frames):
        raise Problem(f"{where}: {len(degrees)} 'degrees' are given for {len(frames)} frames. Diagnose anew.")
    return Goodness(frames, None if degrees is None else tuple(map(float, degrees)))


def untold(body: dict[str, Any]) -> tuple[str, ...]:
    """Parameters that the recording does not tell."""
    return tuple(map(str, _told(body, "untold", "bounds") or ()))


def _told(body: dict[str, Any], *names: str) -> Any:
    """What is under the first of the names that is there, of its own or in the test of the whole fit."""
    told = (body.get("global_test") or {}) | body
    return next((told[name] for name in names if told.get(name)), None)
