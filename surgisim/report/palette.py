"""The report's colours. Told apart by colour-blind readers: Okabe and Ito, Color universal design, 2008."""

import matplotlib
import numpy as np

INK, MUTED, LINE = "#1c2127", "#5d6773", "#d9dee4"
RECORDING, RECONSTRUCTION, REPLAY, STILL = "#1c2127", "#0072b2", "#d55e00", "#8a94a0"
TOOL, SPECULAR, HELD, GRIP = "#009e73", "#e69f00", "#cc79a7", "#0072b2"
PHASE = {"rest": "#ffffff", "load": "#f4ead5", "hold": "#e7e2ef", "released": "#e0edf3"}
DEPTH, ERROR, MOVED, MATERIAL = "viridis", "magma", "viridis", "cividis"


def rgb(color: str) -> np.ndarray:
    """A '#rrggbb' colour, (3,), 0-255."""
    return np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)], float)


def mapped(values: np.ndarray, low: float, high: float, name: str) -> np.ndarray:
    """Values in a colour map, low to high, (..., 3) uint8; NaN is light grey."""
    level = (np.asarray(values, float) - low) / max(high - low, 1e-12)
    known = np.isfinite(level)
    index = np.rint(np.where(known, level, 0).clip(0, 1) * 255).astype(int)
    table = np.rint(matplotlib.colormaps[name](np.arange(256))[:, :3] * 255).astype(np.uint8)
    return np.where(known[..., None], table[index], np.uint8(230))


def gradient(name: str) -> str:
    """The colour map as CSS, left to right."""
    stops = mapped(np.linspace(0, 1, 9), 0, 1, name)
    return "linear-gradient(to right," + ",".join(f"rgb({r},{g},{b})" for r, g, b in stops.tolist()) + ")"
