"""Where an instrument goes and how much nearer it comes, from its outline.

A rigid shaft looks as wide as it is near. Its outline is found between pixels, where the picture changes half-way from
the instrument's colour to what lies behind it, and laid onto the outline of another frame: turned, moved, stretched
along the shaft (which says how far it leans) and grown across it (which says how near it is). A wrist that bends or
jaws that open grow in one place and not in another: then the stretches of the outline contradict each other, and as
unsure is the answer.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial import cKDTree

from surgisim.artifacts.camera import Camera
from surgisim.perception.grasp.instruments import Instrument
from surgisim.perception.tracking.between import sample

REACH = 0.4
"""How far behind the tip the outline is looked at, as a share of the longer image side."""
BORDER = 2
"""Pixels from the border of the picture in which an outline is the picture's and not the instrument's."""
PROFILE = np.arange(-4.0, 4.01, 0.5)
"""Where the picture is read across an outline, outward [px]; half-way lies within 3 px of the mask's."""
FIRM = 30
"""Places that make an outline."""
SHARP = 0.3
"""Error of an outline from which places count less [px]."""
TURN, SLIDE, STRETCH, GROW = 0.5, 0.1, 0.1, 0.5
"""Expected spreads of how an outline is laid onto another: angle [rad], way as a share of the longer image side, growth
along the shaft over that across it, growth across it (logarithms)."""
PARTS = 4
"""Stretches of an outline, one behind the other, that are compared with each other."""
ALONE = np.array([1e-3, 2.0, 1e-5, 0.5, 0.5])
"""Spreads of the same for a stretch alone, about what the whole has: it may grow, stretch, and lie beside it [px]."""
LEAST = 8
"""Places of a stretch that tell how it grows."""
CLOSE = 1e-3
"""A step that ends the search [px]; of angles and growths a thirtieth."""


@dataclass(frozen=True)
class Outline:
    """One instrument's, in T frames."""

    tip: np.ndarray
    """[px], NaN where it is not seen, (T, 2)."""
    along: np.ndarray
    """Direction of the shaft from the tip, unit vectors, (T, 2)."""
    edge: tuple[np.ndarray, ...]
    """Along the shaft from the tip and across it [px], and the normal in the same axes, (N, 4) a frame; N = 0 where
    there is none."""
    camera: Camera

    def ray(self, frames: np.ndarray) -> np.ndarray:
        """X and Y of (X, Y, 1) at which the tip is seen, where the mask ends, (F, 2)."""
        return self._ray(self.tip[frames])

    def carried(self, frames: np.ndarray, reference: int) -> np.ndarray:
        """The ray of the reference frame's tip in others, and the logarithm of its distance there, less that in the
        reference: by the whole outline, and that distance by every stretch of it alone, (F, 3 + PARTS); NaN where too
        little is seen."""
        out = np.stack([self._carried(t, reference) for t in frames])
        return np.concatenate([self._ray(out[:, :2]), out[:, 2:]], -1)

    def _ray(self, pixel: np.ndarray) -> np.ndarray:
        camera = self.camera
        return (pixel - [camera.cx, camera.cy]) / [camera.fx, camera.fy]

    def _carried(self, t: int, reference: int) -> np.ndarray:
        edge, onto = self.edge[t], self.edge[reference]
        if min(len(edge), len(onto)) < FIRM:
            return np.full(3 + PARTS, np.nan)
        side = max(self.camera.width, self.camera.height)
        laid = _laid(edge, onto, np.zeros(5), np.array([SLIDE * side, SLIDE * side, TURN, GROW, STRETCH]))
        part = np.clip((PARTS * edge[:, 0] / max(edge[:, 0].max(), 1e-9)).astype(int), 0, PARTS - 1)
        stretches = [edge[part == p] for p in range(PARTS)]
        alone = [_laid(s, onto, laid, ALONE)[3] if len(s) >= LEAST else np.nan for s in stretches]
        cos, sin = np.cos(laid[2]), np.sin(laid[2])
        place = np.array([[cos, sin], [-sin, cos]]) @ (-laid[:2] / np.exp(laid[3])) / [np.exp(laid[4]), 1.0]
        along = self.along[t]
        tip = self.tip[t] + place @ [along, [-along[1], along[0]]]
        # What has to grow to be like the reference is farther off.
        return np.array([*tip, laid[3], *alone])


def outlines(rgb: np.ndarray, tools: list[Instrument], camera: Camera) -> list[Outline]:
    """Of every instrument. rgb: sRGB, (T, H, W, 3) uint8."""
    return [_outline(found, rgb, camera) for found in tools]


def _outline(found: Instrument, rgb: np.ndarray, camera: Camera) -> Outline:
    side = max(camera.width, camera.height)
    edges, alongs = [], []
    for t, mask in enumerate(found.mask):
        edge, along = np.zeros((0, 4)), np.full(2, np.nan)
        if np.isfinite(found.tip[t]).all() and mask.any():
            place, normal = _between_pixels(rgb[t], mask, _steps(mask, found.tip[t], side))
            along = _axis(mask, found.tip[t], found.entry[t], side)
            axes = np.array([along, [-along[1], along[0]]])
            edge = np.concatenate([(place - found.tip[t]) @ axes.T, normal @ axes.T], 1)
        edges.append(edge)
        alongs.append(along)
    return Outline(found.tip, np.stack(alongs), tuple(edges), camera)


def _steps(mask: np.ndarray, tip: np.ndarray, side: int) -> np.ndarray:
    """Middles between pixels of a mask and their neighbours out of it, (N, 2) [px]."""
    row, column = np.nonzero(mask[:, 1:] != mask[:, :-1])
    below, right = np.nonzero(mask[1:] != mask[:-1])
    place = np.concatenate([np.stack([column + 0.5, row], -1), np.stack([right, below + 0.5], -1)])
    high, wide = mask.shape
    inside = (place > BORDER).all(-1) & (place < [wide - 1 - BORDER, high - 1 - BORDER]).all(-1)
    return place[inside & (np.linalg.norm(place - tip, axis=-1) < REACH * side)]


def _between_pixels(rgb: np.ndarray, mask: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where the colour changes half-way from inside to outside near `place`, and the outward normals there."""
    inward = cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 5)
    outward = cv2.distanceTransform(1 - mask.astype(np.uint8), cv2.DIST_L2, 5)
    away = cv2.GaussianBlur(outward - inward, (0, 0), 1.5)
    slope = np.stack([cv2.Sobel(away, cv2.CV_32F, 1, 0), cv2.Sobel(away, cv2.CV_32F, 0, 1)], -1)
    normal = sample(slope, place).astype(float)
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-6)
    profile = sample(rgb.astype(np.float32), place[:, None] + PROFILE[:, None] * normal[:, None]).astype(float)
    inside, outside = profile[:, PROFILE <= -2], profile[:, PROFILE >= 2]
    change = outside.mean(1) - inside.mean(1)
    size = (change**2).sum(-1)
    share = ((profile - inside.mean(1, keepdims=True)) * change[:, None]).sum(-1) / np.maximum(size, 1e-9)[:, None]
    before, after = share[:, :-1] - 0.5, share[:, 1:] - 0.5
    gap = PROFILE[1] - PROFILE[0]
    at = PROFILE[:-1] - gap * before / np.where(after > before, after - before, 1.0)
    at = np.where((before < 0) & (after >= 0), at, np.inf)
    nearest = np.take_along_axis(at, np.abs(at).argmin(1)[:, None], 1)[:, 0]
    rough = inside.var(1).sum(-1) + outside.var(1).sum(-1)
    clear = (np.abs(nearest) < 3) & (size > rough)
    return place[clear] + nearest[clear, None] * normal[clear], normal[clear]


def _axis(mask: np.ndarray, tip: np.ndarray, entry: np.ndarray, side: int) -> np.ndarray:
    """Direction of the shaft from the tip, a unit vector."""
    row, column = np.nonzero(mask)
    away = np.stack([column, row], -1) - tip
    along = (entry - tip) / max(np.linalg.norm(entry - tip), 1e-9)
    for _ in range(2):
        aside = np.array([-along[1], along[0]])
        near = (away @ along > 0) & (away @ along < REACH * side)
        if near.sum() < FIRM:
            break
        along = along + np.polyfit(away[near] @ along, away[near] @ aside, 1)[0] * aside
        along /= np.linalg.norm(along)
    return along


def _laid(edge: np.ndarray, onto: np.ndarray, start: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """How an outline (N, 4) is laid onto another: shift along and across [px], angle, growth, stretch along it.

    Each place onto the line through the nearest one with a like normal, errors beyond SHARP counting less. spread: of
    the five about where they start.
    """
    tree, at = cKDTree(onto[:, :2]), start.copy()
    held = 1 / spread**2
    for turn in range(30):
        cos, sin = np.cos(at[2]), np.sin(at[2])
        stretched = edge[:, :2] * [np.exp(at[4]), 1.0]
        turned, normal = stretched @ [[cos, sin], [-sin, cos]], edge[:, 2:] @ [[cos, sin], [-sin, cos]]
        place = np.exp(at[3]) * turned + at[:2]
        far, nearest = tree.query(place)
        line = onto[nearest, 2:]
        rest = ((place - onto[nearest, :2]) * line).sum(1)
        width = max(SHARP, 1.5 * 0.9**turn)
        alike = ((line * normal).sum(1) > 0.7) & (far < max(3.0, 8 * 0.8**turn))
        weight = alike / (1 + (rest / width) ** 2) / SHARP**2
        aside, longer = np.stack([-turned[:, 1], turned[:, 0]], -1), stretched[:, :1] * [cos, sin]
        grow = np.exp(at[3])
        slope = np.stack([line[:, 0], line[:, 1], *(grow * (line * d).sum(1) for d in (aside, turned, longer))], 1)
        square = slope.T @ (weight[:, None] * slope) + np.diag(held)
        step = np.linalg.solve(square, slope.T @ (weight * rest) + held * (at - start))
        at = at - step
        if turn > 12 and np.abs(step * [1, 1, 30, 30, 30]).max() < CLOSE:
            break
    return at
