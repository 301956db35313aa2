"""The run as films: strips of panels that play together."""

from dataclasses import dataclass

import numpy as np

from surgisim.report.overlay import enlarged
from surgisim.report.uri import data_uri, jpeg
from surgisim.side_by_side import in_order
from surgisim.video import mp4

GAP = 8
"""White between panels [px]."""


@dataclass(frozen=True)
class Film:
    uri: str
    captions: tuple[str, ...]
    """One a panel, left to right."""
    width: int
    height: int
    still: str = ""
    """One frame as a picture, for paper."""
    bar: tuple[str, str, str, str] | None = None
    """Colour bar: CSS gradient, low end, high end, label."""


def strip(panels: dict[str, np.ndarray], width: int, **more) -> Film:
    """Panels (T, H, W, 3) uint8 by caption, side by side, each `width` [px] wide; the rest as in `joined`."""
    wide = [np.stack(list(in_order(enlarged, ((f, width) for f in frames)))) for frames in panels.values()]
    return joined(dict(zip(panels, wide, strict=True)), **more)


def joined(panels: dict[str, np.ndarray], *, fps: float, quality: int, paper: int, bar=None) -> Film:
    """Panels that already have their size; shorter ones are centred on white. Frame `paper` is printed."""
    tall = max(p.shape[1] for p in panels.values())
    parts: list[np.ndarray] = []
    for panel in panels.values():
        spare = tall - panel.shape[1]
        room = ((0, 0), (spare // 2, spare - spare // 2), (0, 0), (0, 0))
        parts += [np.pad(panel, room, constant_values=255), np.full((len(panel), tall, GAP, 3), 255, np.uint8)]
    frames = np.concatenate(parts[:-1], 2)
    content = mp4(frames, fps, quality=quality)
    still = jpeg(frames[min(paper, len(frames) - 1)])
    return Film(data_uri(content, "video/mp4"), tuple(panels), frames.shape[2], frames.shape[1], still, bar)
