"""Drawing on top of recorded frames."""

import cv2
import numpy as np

from surgisim.report.palette import GRIP, SPECULAR, TOOL, rgb


def tinted(frame: np.ndarray, mask: np.ndarray, color: str, strength: float = 0.5) -> np.ndarray:
    """`frame` (H, W, 3) uint8 with `mask` (H, W) bool in a colour, outlined."""
    mixed = np.where(mask[..., None], (1 - strength) * frame + strength * rgb(color), frame)
    inner = cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    return np.where((mask & ~inner)[..., None], rgb(color), mixed).astype(np.uint8)


def masks(frame: np.ndarray, tool: np.ndarray, specular: np.ndarray, tissue: np.ndarray) -> np.ndarray:
    """Instrument green, highlights orange, what is neither of these nor tissue faded."""
    faded = np.where((tissue | tool | specular)[..., None], frame, 0.45 * frame + 0.55 * 255).astype(np.uint8)
    return tinted(tinted(faded, specular, SPECULAR, 0.7), tool, TOOL)


def enlarged(frame: np.ndarray, width: int) -> np.ndarray:
    """The frame at `width` [px], as smooth as the eye of a viewer would make it."""
    height = round(frame.shape[0] * width / frame.shape[1])
    way = cv2.INTER_CUBIC if width > frame.shape[1] else cv2.INTER_AREA
    return cv2.resize(frame, (width, height), interpolation=way)


def tracks(frame: np.ndarray, xy: np.ndarray, visible: np.ndarray, t: int, width: int, tail: int = 10) -> np.ndarray:
    """The frame at `width` with every visible point and the way it came in the last `tail` frames.

    Points (K, T, 2) [px of the frame]; coloured by how far they are from where they began.
    """
    from surgisim.report.palette import MOVED, mapped

    grey = cv2.cvtColor(cv2.cvtColor(enlarged(frame, width), cv2.COLOR_RGB2GRAY), cv2.COLOR_GRAY2RGB)
    picture = (0.75 * grey + 0.25 * 235).astype(np.uint8)
    zoom = width / frame.shape[1]
    moved = np.linalg.norm(xy - xy[:, :1], axis=-1)
    top = max(float(np.percentile(moved[visible], 99)) if visible.any() else 1.0, 1.0)
    color = mapped(moved[:, t], 0, top, MOVED)
    for k in np.argsort(moved[:, t], kind="stable"):
        if not visible[k, t]:
            continue
        trail = xy[k, max(t - tail, 0) : t + 1]
        points = np.rint(((trail + 0.5) * zoom - 0.5) * 16).astype(np.int32)
        shade = tuple(int(c) for c in color[k])
        cv2.polylines(picture, [points[:, None]], False, shade, 1, cv2.LINE_AA, 4)
        cv2.circle(picture, tuple(points[-1].tolist()), 28, shade, -1, cv2.LINE_AA, 4)
    return picture


def grip(picture: np.ndarray, center: np.ndarray, radius: float, held: bool) -> None:
    """Draw a gripped ball into the picture: centre (2,) and radius [px]; dashed once it is let go."""
    color = tuple(int(c) for c in rgb(GRIP))
    middle, size = tuple(np.rint(center * 16).astype(int).tolist()), round(radius * 16)
    for ink, thick in (((255, 255, 255), 5), (color, 2)):
        if held:
            cv2.circle(picture, middle, size, ink, thick, cv2.LINE_AA, 4)
        else:
            for start in range(0, 360, 30):
                cv2.ellipse(picture, middle, (size, size), 0, start, start + 14, ink, thick, cv2.LINE_AA, 4)
