"""Depth from the lamp that rides on the endoscope; needs no weights.

A lamp at the camera lights a surface of albedo rho at distance d under slant theta with I = rho cos(theta) / d^2.
With w = log z on the image, X = (x - cx) / fx, Y alike and r = (X, Y, 1), that is

    log I = log rho - 2 w - 3 log |r| - 1/2 log(w_X^2 + w_Y^2 + (1 + X w_X + Y w_Y)^2)

(perspective near-light shading; Prados and Faugeras, Shape from shading: a well-posed problem?, CVPR 2005).
In frame 0 albedo and shape share the blame: what goes with the hue is albedo, what goes with the square of the distance
from the view's middle may be the lamp, what is smooth is mostly shape.
Afterwards the albedo travels with the tissue: a change of brightness along its way is a change of distance and slant,
and with the motion seen across the view, the instrument's too, it tells how far pulled tissue comes nearer (pull.py).
What is lost, or goes otherwise than pulled tissue, comes as much nearer as it grows brighter (brightening.py).
The absolute size is not known: the median depth of frame 0 is set to a nominal one.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.correspondence import Correspondence
from surgisim.lighting.headlight import linear_light
from surgisim.lighting.veil import ABOVE, veil_of
from surgisim.perception.depth.brightening import brightened
from surgisim.perception.depth.pull import Watched, nearer
from surgisim.perception.depth.shading import Lattice, explain, shading
from surgisim.perception.grasp.outline import Outline
from surgisim.perception.tracking.spread import spread
from surgisim.side_by_side import in_order

TRUST = 0.5
"""Confidence of a well explained pixel: brightness tells changes well and shapes only roughly."""
ALBEDO, HUE, FALL_OFF = 0.25, 0.15, 1.0
"""Spread of log albedo that hue does not explain; of the hue's coefficients; of how far the lamp's log brightness falls
off from the view's middle to its corner."""
SAMPLES = 50
"""Pixels of as much albedo by itself as a frame has."""
TURNS = 20
"""How often shape and albedo take turns: where tissue lies steep, six left a sixth of the slope unfound."""
STRETCH, AFRESH = 16, 3
"""Frames whose shapes by themselves are begun from one another; turns of the first of them, begun from frame 0's."""
BESIDE = 2
"""How far beside what is hidden light may be the instrument's doing, its shadow and its blur [lattice px]."""
FIRST_DETAIL = 0.6
"""Finest wave of shape that is believed, as a share of the longer image side."""


@dataclass(frozen=True)
class _Look:
    """One frame on the lattice, with what frame 0's tissue brings along."""

    start: np.ndarray
    """Log depth the tissue had in frame 0, (h, w)."""
    light: np.ndarray
    """Log brightness over the albedo of frame 0's tissue there, (h, w)."""
    known: np.ndarray
    """How far its light is seen and is that of tissue which frame 0 shows, 0-1, (h, w)."""
    sure: np.ndarray
    """How surely it is that tissue, 0-1, (h, w)."""
    moved: np.ndarray
    """How far it has gone [lattice px], (h, w)."""
    origin: np.ndarray
    """Where in frame 0 it was [lattice px], (h, w, 2)."""


def estimate(
    rgb: np.ndarray,
    hidden: np.ndarray,
    specular: np.ndarray,
    camera: Camera,
    surface: Correspondence,
    *,
    distance: float = 0.07,
    size: int = 64,
    relief: float = 0.3,
    tools: Sequence[Outline] = (),
    progress: Callable[[float, float, str], None] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Depth [m] and confidence 0-1 of a recording without its instrument, (T, H, W) float32 each.

    rgb: sRGB, (T, H, W, 3) uint8. hidden: pixels whose colour is not the tissue's at that time, specular: highlights,
    (T, H, W) bool. surface: where frame 0's pixels went. distance: median depth of frame 0 [m]. size: longer side of
    the lattice it is solved on [px]. relief: expected spread of log depth in frame 0 about its mean slope. tools: the
    instruments, as they are seen.
    """
    ratio = min(1.0, size / max(rgb.shape[1:3]))
    lattice = Lattice.of(camera, ratio)
    grey = veil_of(rgb, hidden | specular)
    light, hue, known = _read(rgb[0], hidden[0] | specular[0], lattice.shape, grey)
    rest = _first(lattice, light, hue, known, relief)
    rest += np.log(distance) - np.median(rest[known > 0.5] if (known > 0.5).any() else rest)
    albedo = light + shading(lattice, rest)
    frames, watched = [], []
    asked = ((f, h | s, lattice.shape, grey) for f, h, s in zip(rgb, hidden, specular, strict=True))
    looks = list(in_order(_read, asked))
    by_itself = _by_themselves(lattice, looks, rest - np.median(rest), relief)
    for t, (now, alone) in enumerate(zip(looks, by_itself, strict=True)):
        position, sure = _placed(surface, t, lattice)
        frames.append((sure, now, alone))
        watched.append(_watch(lattice, position, sure, now))
        if progress:
            progress(t + 1, 2 * len(rgb), "light along the tissue's way")
    z, confidence, origin = [], [], lattice.pixels
    pulled = nearer(lattice, rest, Watched(*map(np.stack, zip(*watched, strict=True))), tools)
    for t, (frame, change, place, explained) in enumerate(zip(frames, *pulled, strict=True)):
        position = (place.reshape(lattice.ray.shape) - lattice.ray[0, 0]) / (lattice.ray[1, 1] - lattice.ray[0, 0])
        look = _look(lattice, position, *frame, rest, albedo, origin)
        origin = look.origin
        log_z = look.start + _at(change, look.origin)
        beyond = look.light + shading(lattice, log_z)
        clear = 1 - cv2.dilate(_shrink(hidden[t], lattice.shape), np.ones((2 * BESIDE + 1, 2 * BESIDE + 1)))
        log_z = log_z + brightened(beyond, look.known * clear, look.sure, look.moved, 1 - explained)
        misfit = np.where(look.known > 0, look.light + shading(lattice, log_z), 0.0)
        z.append(_grow(np.exp(log_z), rgb.shape[1:3]))
        trust = TRUST * np.exp(-((misfit / 0.3) ** 2)) * (0.2 + 0.8 * look.sure * look.known)
        confidence.append(np.clip(_grow(trust, rgb.shape[1:3]), 0.0, 1.0))
        if progress:
            progress(len(rgb) + t + 1, 2 * len(rgb), "depth from light")
    return np.stack(z).astype(np.float32), np.stack(confidence).astype(np.float32)


def _by_themselves(lattice: Lattice, looks: list[tuple], first: np.ndarray, relief: float) -> Iterator[np.ndarray]:
    """The log depth that each frame suggests by itself, begun from that of the last; stretches of them side by side."""

    def stretch(begin: int) -> list[np.ndarray]:
        found = []
        for t in range(begin, min(begin + STRETCH, len(looks))):
            last, turns = (found[-1], 1) if found else (first, AFRESH)
            found.append(_first(lattice, *looks[t], relief, begin=last, turns=turns) if t else first)
        return found

    for part in in_order(stretch, zip(range(0, len(looks), STRETCH))):
        yield from part


def _placed(surface: Correspondence, frame: int, lattice: Lattice) -> tuple[np.ndarray, np.ndarray]:
    """Where frame 0's lattice pixels are [lattice px], (h, w, 2), and how surely 0-1, (h, w)."""
    seen, error = surface.seen[frame], surface.error[frame].astype(np.float32)
    sure = _shrink(seen * np.exp(-((error / 0.8) ** 2)), lattice.shape)
    scale = np.array(lattice.shape[::-1]) / np.array(seen.shape[::-1])
    return (_shrink(surface.position(frame), lattice.shape) + 0.5) * scale - 0.5, sure


def _watch(lattice: Lattice, position: np.ndarray, sure: np.ndarray, now) -> tuple[np.ndarray, ...]:
    """One frame's share of what `nearer` compares."""
    light, _, known = now
    flat = _at(lattice.ray[..., 0], position), _at(lattice.ray[..., 1], position)
    parts = np.stack(flat, -1).reshape(-1, 2), sure, _at(light, position), _at(known, position)
    return parts[0], *(part.ravel() for part in parts[1:])


def _look(lattice, position, sure, now, alone, rest, albedo, origin) -> _Look:
    light, _, known = now
    origin, found = _inverse(position, origin, lattice)
    sure = found * _at(sure, origin)
    # Tissue that frame 0 did not show has the shape that this frame alone suggests, fitted to what is known around it.
    surely = found.max() > 0.1
    start = alone + (spread(_at(rest, origin) - alone, found) if surely else np.median(rest) - np.median(alone))
    moved = spread(np.linalg.norm(origin - lattice.pixels, axis=-1), sure)
    moved = cv2.GaussianBlur(moved.astype(np.float32), (0, 0), 1.5).astype(float)
    excess = light - _at(albedo, origin)
    followed = sure * known > 0.5
    still = followed & (moved < 0.5)
    # Exposure is what still tissue, or where none is all that is followed, shares.
    tells = still if still.mean() > 0.05 else followed
    gain = np.median((excess + shading(lattice, start))[tells]) if tells.mean() > 0.05 else 0.0
    return _Look(start, excess - gain, found * known, sure, moved, origin)


def _read(rgb: np.ndarray, covered: np.ndarray, shape: tuple[int, int], grey: float):
    """Log brightness (h, w), hue (h, w, 2) and the share of usable pixels (h, w) on the small lattice.

    grey: the veil before the tissue, linear light 0-1.
    """
    linear = linear_light(rgb) - grey
    usable = ~covered & (rgb.max(-1) < 250) & (rgb.max(-1) > 8) & (linear.min(-1) >= ABOVE * grey)
    share = _shrink(usable, shape)
    mean = _shrink(linear * usable[..., None], shape) / np.maximum(share, 1e-6)[..., None]
    mean = np.maximum(spread(mean, share), 1e-5)
    hue = np.log(mean[..., :1] / mean[..., 1:])
    return np.log(mean.mean(-1)).astype(float), hue.astype(float), share.astype(float)


def _first(
    lattice: Lattice,
    light: np.ndarray,
    hue: np.ndarray,
    known: np.ndarray,
    relief: float,
    *,
    begin: np.ndarray | None = None,
    turns: int = TURNS,
) -> np.ndarray:
    """Log depth of one frame by itself, about 0: shape, and hue's share of the albedo and the lamp's, in turns."""
    log_z, use = np.zeros_like(light) if begin is None else begin, known > 0.5
    if use.sum() < 16:
        return log_z
    falls = (lattice.ray.reshape(*light.shape, 2) ** 2).sum(-1, keepdims=True)
    features = np.concatenate([hue, falls / falls.max()], -1)
    features -= np.median(features[use], axis=0)
    prior = np.diag((ALBEDO / np.array([HUE, HUE, FALL_OFF])) ** 2) / SAMPLES
    for _ in range(turns):
        rho = light + shading(lattice, log_z)
        tilt = features[use].T @ features[use] / use.sum() + prior
        weights = np.linalg.solve(tilt, features[use].T @ (rho[use] - np.median(rho[use])) / use.sum())
        painted = features @ weights
        level = np.median((rho - painted)[use])
        plane = _plane(lattice, log_z)
        log_z, _ = explain(
            lattice,
            light - painted - level,
            known,
            plane,
            spread_of_data=ALBEDO,
            spread_of_shape=relief,
            finest=FIRST_DETAIL,
            smooth_about=plane,
            begin=log_z,
        )
    return log_z


def _plane(lattice: Lattice, log_z: np.ndarray) -> np.ndarray:
    """The log depth of a plane that lies as the surface does, about 0, (h, w): tissue may be slanted to the view."""
    flat = np.concatenate([lattice.ray.reshape(-1, 2), np.ones((log_z.size, 1))], -1)
    # The inverse depth of a plane is linear across the view. Its fit to positive numbers is positive but for shapes
    # that no recording shows; there the plane is one of log depth.
    inverse = flat @ np.linalg.lstsq(flat, np.exp(-log_z.ravel()), rcond=None)[0]
    if inverse.min() > 0:
        plane = -np.log(inverse).reshape(log_z.shape)
    else:
        plane = (flat @ np.linalg.lstsq(flat, log_z.ravel(), rcond=None)[0]).reshape(log_z.shape)
    return plane - np.median(plane)


def _inverse(position: np.ndarray, start: np.ndarray, lattice: Lattice):
    """Where in frame 0 each pixel came from (h, w, 2) [lattice px], and whether it did, 0-1 (h, w)."""
    grid, origin = lattice.pixels, start
    for _ in range(15):
        origin = origin + 0.7 * (grid - _at(position, origin))
    miss = np.linalg.norm(_at(position, origin) - grid, axis=-1)
    high, wide = lattice.shape
    inside = (origin > -1).all(-1) & (origin[..., 0] < wide) & (origin[..., 1] < high)
    good = np.exp(-((miss / 0.5) ** 2)) * inside
    return np.where(np.isfinite(origin), origin, grid).astype(np.float32), good


def _at(field: np.ndarray, where: np.ndarray) -> np.ndarray:
    x, y = where[..., 0].astype(np.float32), where[..., 1].astype(np.float32)
    out = cv2.remap(field.astype(np.float32), x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return out.astype(float)


def _shrink(field: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    return cv2.resize(field.astype(np.float32), shape[::-1], interpolation=cv2.INTER_AREA)


def _grow(field: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    return cv2.resize(field, shape[::-1], interpolation=cv2.INTER_LINEAR)
