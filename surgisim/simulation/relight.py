"""The lamp of a recording, learned on used frames, and splats that look lit by it wherever they are moved."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.frames import USED, Frames
from surgisim.artifacts.masks import Masks
from surgisim.artifacts.scene import Scene
from surgisim.gaussians.surface import surface_of
from surgisim.lighting.headlight import log_brightness_change, to_linear, to_srgb
from surgisim.lighting.highlights import LOBES, share_left, without
from surgisim.lighting.normals import at_pixels, rest_normals, turned
from surgisim.lighting.recorded import beside, shown
from surgisim.lighting.response import Response, fit_response
from surgisim.lighting.strength import Strength, fit_strength, mildest
from surgisim.mpm.carried import Carried
from surgisim.mpm.nodes import Nodes
from surgisim.simulation.draw import Shade

AMBIENT = (0.02, 0.05, 0.1, 0.2, 0.4, 0.7, 1.0)
"""Ambient shares to choose from; 1 leaves the fall over distance alone [1]."""
BLUR = 0.25
"""Blur with which brightness is read along the way of the surface [grid spacing]."""
PATCH = 4.0
"""Side of the patches whose errors go together [grid spacing]."""
SHARP = 0.7
"""Blur with which a colour under a highlight is read [px]."""
OFTEN = 3
"""Frames that have to show tissue without its highlight before its colour is believed."""
MOVED = 0.25
"""Share of the largest displacement from which tissue counts as moved."""
JUDGED = 5
"""Used frames, of the half in which tissue has gone farthest, on whose pictures a light has to prove itself."""


@dataclass(frozen=True)
class Light:
    """What is known of the lamp, and what it lights at rest."""

    camera: Camera
    normals: np.ndarray
    """Of the surface seen at rest, out of the tissue, (H, W, 3)."""
    diffuse: np.ndarray
    """Linear light of frame 0 without its highlights, (H, W, 3)."""
    glint: np.ndarray
    """Pixels of frame 0 in or beside a highlight, (H, W) bool."""
    strength: Strength
    ambient: float
    lobe: float
    response: Response | None = None
    """What tissue's brightness does beside, where it moves; None where that is left aside."""

    @property
    def words(self) -> str:
        s = self.strength
        beside = self.response.words if self.response else "nothing"
        return (
            f"slope {s.slope:.2f} +- {s.error:.2f}, applied {s.value:.2f}, ambient share {self.ambient:g}, "
            f"highlights' lobe {self.lobe:g}; beyond the lamp: {beside}"
        )

    def shade(self, rest: np.ndarray, color: np.ndarray) -> Shade:
        """How splats at rest [m], (G, 3), of `color`, sRGB (G, 3), look once they are moved."""
        rest = np.asarray(rest, float)
        pixel = self.camera.project(rest)
        normal = at_pixels(self.normals, pixel)
        light = to_linear(np.asarray(color, float))
        column = np.clip(np.rint(pixel[:, 0]), 0, self.camera.width - 1).astype(int)
        row = np.clip(np.rint(pixel[:, 1]), 0, self.camera.height - 1).astype(int)
        under = self.glint[row, column]
        own = np.where(under[:, None], np.minimum(light, at_pixels(self.diffuse, pixel)), light)
        mirrored = (light - own)[under]

        def colors(moved: np.ndarray, F: np.ndarray) -> np.ndarray:
            out = own * np.exp(self.change(pixel, rest, normal, moved, F))[:, None]
            out[under] += mirrored * share_left(rest[under], moved[under], F[under], self.lobe)[:, None]
            return to_srgb(out)

        return colors

    def change(
        self, pixel: np.ndarray, rest: np.ndarray, normal: np.ndarray, moved: np.ndarray, F: np.ndarray
    ) -> np.ndarray:
        """Log brightness gained by moving, as far as it is believed, (Q,); pixel: where it is seen at rest, (Q, 2)."""
        lit = self.strength.value * log_brightness_change(rest, normal, moved, turned(F, normal), self.ambient)
        return lit if self.response is None else lit + self.response.change(pixel, moved - rest)


def find_light(
    scene: Scene,
    camera: Camera,
    spacing: float,
    simulator: Nodes,
    states: Sequence[np.ndarray],
    frames: Frames,
    masks: Masks,
    under: Callable[["Light"], Callable[[np.ndarray], np.ndarray]],
) -> Light:
    """Learn the lamp from how the recorded brightness of carried tissue changes; frames held out are not looked at.

    states: displacement of the solid nodes [m] at every frame of the recorded manipulation, (A, 3) each. under: what
    a light makes of the scene, from such a state to (H, W, 3) uint8: where tissue is not where it was, brightness along
    its way is another's, so of a light with and without each of its parts the one whose pictures are nearest is taken,
    and the plainest of those that are about as near.
    """
    surface = surface_of(scene, camera)
    normals = rest_normals(surface.z, camera, spacing)
    cell = spacing * camera.fx / float(np.median(surface.z))
    used = [(t, u) for t, u in enumerate(states) if t < len(frames.split) and frames.split[t] == USED]
    stride = max(cell / 2, 1.0)
    pixels = _grid(masks.tissue[0], stride)
    way = _Way(pixels, surface.z, normals, camera, simulator, used, stride)
    recorded, seen = _recorded(way, used, frames, masks, BLUR * cell)
    patch = np.floor(pixels / (PATCH * cell)).astype(int)
    cluster = patch[:, 1] * (patch[:, 0].max(initial=0) + 1) + patch[:, 0]
    fits = [(a, fit_strength(way.change(a), recorded, seen, cluster)) for a in AMBIENT]
    ambient, strength = max(fits, key=lambda f: f[1].slope / f[1].error)
    rest = to_linear(frames.rgb[0].astype(float) / 255)
    glint = beside(masks.specular[0]) & ~masks.tool[0]
    gone = np.stack(way.moved, 1) - way.rest[:, None]
    seen &= way.in_front(spacing)
    lights = []
    for value in dict.fromkeys((0.0, strength.value)):
        left = recorded - value * way.change(ambient) - strength.gain
        response = fit_response(pixels, stride, cell, gone, left, seen & np.isfinite(left))
        lamp = replace(strength, value=value)
        plain = Light(camera, normals, without(rest, glint), glint, lamp, ambient, 0.0)
        lights += [plain, replace(plain, response=response)][: 1 if response.choice is None else 2]
    best = _nearest(lights, under, way, used, frames, masks, cell)
    return _with_highlights(best, rest, surface.z, simulator, used, frames, masks)


class _Way:
    """Points of the rest surface at every used frame."""

    def __init__(self, pixels, z, normals, camera, simulator, used, stride: float = 1.0) -> None:
        self.stride = stride
        self.rest = camera.lift(pixels, at_pixels(z[..., None], pixels)[:, 0])
        self.normal = at_pixels(normals, pixels)
        carried = Carried(self.rest, simulator)
        self.moved, self.F = zip(*(carried.at(u) for _, u in used), strict=True)
        self.pixels = [camera.project(m) for m in self.moved]

    def in_front(self, depth: float) -> np.ndarray:
        """Whether no other point is seen before it, nearer by `depth` [m] or more, (K, T) bool."""
        front = []
        for moved, pixel in zip(self.moved, self.pixels, strict=True):
            beside = cKDTree(pixel).query_ball_point(pixel, self.stride)
            nearest = np.array([moved[b, 2].min() for b in beside])
            front.append(moved[:, 2] - nearest < depth)
        return np.stack(front, 1)

    def farthest(self, count: int) -> np.ndarray:
        """So many frames, evenly, of the half in which points have gone farthest."""
        far = np.array([((moved - self.rest) ** 2).sum(-1).mean() for moved in self.moved])
        order = np.argsort(far)[len(far) // 2 :]
        return order[np.linspace(0, len(order) - 1, min(count, len(order))).astype(int)]

    def moving(self, k: int, shape: tuple[int, int], near: float) -> np.ndarray:
        """Pixels (H, W) bool with a point at most `near` px away that has gone MOVED of the most at the k-th frame."""
        far = np.linalg.norm(self.moved[k] - self.rest, axis=1)
        y, x = np.mgrid[: shape[0], : shape[1]]
        away, point = cKDTree(self.pixels[k]).query(np.stack([x.ravel(), y.ravel()], 1))
        return ((away <= near) & (far[point] >= MOVED * far.max())).reshape(shape)

    def change(self, ambient: float) -> np.ndarray:
        """Predicted log change of brightness, (K, T)."""
        each = zip(self.moved, self.F, strict=True)
        return np.stack(
            [log_brightness_change(self.rest, self.normal, m, turned(F, self.normal), ambient) for m, F in each], 1
        )


def _recorded(way: _Way, used, frames, masks, blur: float) -> tuple[np.ndarray, np.ndarray]:
    """Change of log brightness along the way since the first used frame, and where it is known, (K, T) each."""
    light = [shown(t, at, frames, masks, blur) for (t, _), at in zip(used, way.pixels, strict=True)]
    level = np.stack([np.log(np.maximum(brightness, 1e-6)).mean(-1) for brightness, _ in light], 1)
    known = np.stack([known for _, known in light], 1)
    return level - level[:, :1], known & known[:, :1]


def _nearest(lights: list[Light], under, way: _Way, used, frames, masks, cell: float) -> Light:
    """The light whose pictures are nearest to frames in which tissue has gone far; of about as near ones the first."""
    judged, pictures = way.farthest(JUDGED), [under(light) for light in lights]
    error = np.zeros((len(lights), len(judged)))
    for k, j in enumerate(judged):
        t, u = used[j]
        # Where nothing moves all of them draw the same.
        here = masks.tissue[t] & ~beside(masks.specular[t]) & way.moving(j, masks.tissue.shape[1:], cell)
        for n, picture in enumerate(pictures):
            error[n, k] = (((picture(u) - frames.rgb[t].astype(float))[here] / 255) ** 2).sum()
    return lights[mildest(tuple(range(len(lights))), error)]


def _with_highlights(plain: Light, rest, z, simulator, used, frames, masks) -> Light:
    """The same with the colours that other frames show under the highlights, and the lobe that explains them best."""
    pixels = np.argwhere(plain.glint)[:, ::-1].astype(float)
    if len(pixels) == 0:
        return plain
    way = _Way(pixels, z, plain.normals, plain.camera, simulator, used)
    each = zip(way.moved, way.F, strict=True)
    change = np.stack([plain.change(pixels, way.rest, way.normal, moved, F) for moved, F in each], 1)
    colors = np.full((len(pixels), len(used), 3), np.nan)
    for k, (t, _) in enumerate(used):
        light, known = shown(t, way.pixels[k], frames, masks, SHARP)
        colors[known, k] = light[known] / np.exp(change[known, k, None])
    often = np.isfinite(colors[..., 0]).sum(1) >= OFTEN
    diffuse = plain.diffuse.copy()
    column, row = pixels.astype(int).T
    diffuse[row[often], column[often]] = np.nanmedian(colors[often], 1)
    own = np.minimum(diffuse[row, column], rest[row, column])
    error = np.zeros((len(LOBES), len(used)))
    for k, (t, _) in enumerate(used):
        at = np.rint(way.pixels[k]).astype(int)
        inside = ((at >= 0) & (at < [plain.camera.width, plain.camera.height])).all(-1)
        x, y = np.where(inside[:, None], at, 0).T
        here = inside & (masks.tissue[t] | masks.specular[t] & ~masks.tool[t])[y, x]
        shine = rest[row, column] - own
        for n, lobe in enumerate(LOBES):
            left = share_left(way.rest, way.moved[k], way.F[k], lobe)
            drawn = to_srgb(own * np.exp(change[:, k, None]) + shine * left[:, None])
            error[n, k] = ((np.minimum(drawn, 1.0) - frames.rgb[t, y, x] / 255)[here] ** 2).sum()
    return replace(plain, diffuse=diffuse, lobe=mildest(LOBES, error))


def _grid(tissue: np.ndarray, stride: float) -> np.ndarray:
    """Points on tissue, `stride` px apart, (K, 2) [px]."""
    high, wide = tissue.shape
    y, x = np.meshgrid(np.arange(0, high - 0.5, stride), np.arange(0, wide - 0.5, stride), indexing="ij")
    points = np.stack([x.ravel(), y.ravel()], 1)
    at = np.rint(points).astype(int)
    return points[tissue[at[:, 1], at[:, 0]]]
