"""The look of invented tissue: colour, fine relief and gloss, attached to rest coordinates."""

from dataclasses import dataclass

import cv2
import numpy as np

from surgisim.phantom.block import Shape

PITCH = 1.1e-4
"""Texel [m]; about half a subpixel of the default view."""


@dataclass(frozen=True)
class Texture:
    """Spread evenly from the shape's least to its greatest u, v."""

    layers: np.ndarray
    """Linear colour 0-1, slope of the fine relief along u and v, strength of glints 0-1; (V, U, 6) float32."""


def paint(shape: Shape, rng: np.random.Generator) -> Texture:
    """Moist pink tissue with mottling, fat, branching vessels and fine grain."""
    size = np.ceil((shape.high - shape.low) / PITCH).astype(int)[::-1]
    blood = 0.75 * _clouds(size, rng, [16e-3, 7e-3]) + 0.65 * _clouds(size, rng, [3.5e-3, 1.8e-3])
    fat = _smoothstep(0.7, 2.2, _clouds(size, rng, [14e-3, 6e-3, 2e-3]))
    grain = _clouds(size, rng, [1.3e-3, 0.8e-3])
    veins, arteries = _vessels(size, rng, 4, 6.5e-4), _vessels(size, rng, 6, 3.2e-4)
    pink, red, yellow = np.array([0.60, 0.27, 0.22]), np.array([0.44, 0.115, 0.095]), np.array([0.66, 0.40, 0.17])
    share = _smoothstep(-2.2, 2.2, blood)[..., None]
    colour = pink * (1 - share) + red * share
    colour = colour * (1 - 0.7 * fat[..., None]) + yellow * 0.7 * fat[..., None]
    colour *= np.exp(0.10 * grain + 0.10 * _clouds(size, rng, [2.6e-3]))[..., None]
    colour = _stain(colour, veins, np.array([0.24, 0.045, 0.070]), 0.70)
    colour = _stain(colour, arteries, np.array([0.38, 0.030, 0.028]), 0.75)
    height = 1.5e-4 * _clouds(size, rng, [7e-3, 3.5e-3]) + 1.8e-5 * _clouds(size, rng, [1.8e-3]) + 1.0e-4 * veins
    slope = np.stack([np.gradient(height, PITCH, axis=1), np.gradient(height, PITCH, axis=0)], -1)
    wet = _smoothstep(0.0, 2.0, _clouds(size, rng, [9e-3, 4e-3]))
    layers = np.concatenate([np.clip(colour, 0.01, 0.95), slope, 0.04 + 0.96 * wet[..., None]], -1)
    return Texture(layers.astype(np.float32))


def _clouds(size: np.ndarray, rng: np.random.Generator, scales: list[float]) -> np.ndarray:
    """Smooth noise of unit variance at several scales [m]."""
    total = np.zeros(size, np.float32)
    for scale in scales:
        step = scale / PITCH / 3.5
        coarse = rng.standard_normal(np.ceil(size / step).astype(int) + 3).astype(np.float32)
        corner = rng.uniform(0, 1, 2)
        turn = np.array([[1 / step, 0, corner[0]], [0, 1 / step, corner[1]]], np.float32)
        layer = cv2.warpAffine(
            cv2.GaussianBlur(coarse, (0, 0), 1.0),
            turn,
            (int(size[1]), int(size[0])),
            flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_REFLECT,
        )
        total += layer / layer.std()
    return total / total.std()


def _vessels(size: np.ndarray, rng: np.random.Generator, trees: int, radius: float) -> np.ndarray:
    """Coverage 0-1 of wandering, tapering, branching lines that cross the whole piece."""
    canvas = np.zeros(size, np.float32)
    for _ in range(trees):
        start = rng.uniform(0, 1, 2) * size[::-1]
        heading = rng.uniform(0, 2 * np.pi)
        start -= 0.5 * size.max() * np.array([np.cos(heading), np.sin(heading)]) * rng.uniform(0.2, 1)
        _branch(canvas, start, heading, radius * rng.uniform(0.7, 1.4) / PITCH, 0, rng)
    return cv2.GaussianBlur(canvas, (0, 0), 0.9)


def _branch(canvas, at, heading, radius, depth, rng) -> None:
    turn, step = 0.0, 6.0
    for _ in range(rng.integers(60, 220)):
        turn = 0.8 * turn + rng.normal(0, 0.06)
        heading += turn
        to = at + step * np.array([np.cos(heading), np.sin(heading)])
        shade = float(min(1.0, 0.25 + 0.22 * radius))
        width = max(1, round(2 * radius))
        ends = [tuple(int(c) for c in np.rint(p * 8)) for p in (at, to)]
        cv2.line(canvas, ends[0], ends[1], shade, width, cv2.LINE_AA, 3)
        at, radius = to, radius * 0.996
        if depth < 3 and rng.uniform() < 0.03:
            _branch(canvas, at, heading + rng.choice([-1, 1]) * rng.uniform(0.4, 1.0), 0.7 * radius, depth + 1, rng)


def _stain(colour: np.ndarray, cover: np.ndarray, with_colour: np.ndarray, strength: float) -> np.ndarray:
    share = strength * cover[..., None]
    return colour * (1 - share) + with_colour * share


def _smoothstep(low: float, high: float, x: np.ndarray) -> np.ndarray:
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)
