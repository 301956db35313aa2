"""Whether the scene is a surface that moves as tissue does: a simulation needs that more than pictures that are alike.

Colours alone do not say where tissue goes, and a scene may look right whose splats are anywhere.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.ndimage import map_coordinates
from scipy.spatial import Delaunay, cKDTree
from scipy.special import expit

from surgisim.deformation.field import displace, load_field
from surgisim.measure.compared import OF_MOVING, from_start, moving
from surgisim.measure.groups.depth_change import sampled
from surgisim.measure.number import number, ranged
from surgisim.measure.resample import ratio
from surgisim.measure.run import OfScene, Run

FRAMES = 24
"""Frames that are looked at, evenly through the clip."""
NEIGHBOURS = 6
OPAQUE = 0.5
"""Opacity from which a splat is part of the surface [1]."""
BEFORE = 0.03
"""How far before the surface a splat floats, as a share of the surface's distance; chosen, as SPIKE."""
TINY = 1e-9
"""Distance below which neighbours lie on one another [m]."""
SLIVER = 0.02
"""Twice the area of a triangle below which it is none [px^2]."""
SPIKE = 4.0
"""Times the median of all splats' longest radii from which one is a spike."""


def scene_geometry(run: Run | OfScene) -> dict[str, dict[str, Any]]:
    """Of the canonical scene and of where its field carries it."""
    numbers = _against(run, run.tracks.xy, run.tracks.visible, "motion", "tracks") | _of_neighbours(run) | _at_rest(run)
    # The field is told where the surface was seen to go, by what tracks ride on: only the truth tells whether it is so.
    if run.truth is not None:
        numbers |= _against(run, run.truth.xy, run.truth.visible, "true_motion", "the truth")
    return numbers


def _against(
    run: Run | OfScene, xy: np.ndarray, visible: np.ndarray, name: str, what: str
) -> dict[str, dict[str, Any]]:
    """Where the field carries points, and where they are: xy (K, T, 2) [px], visible (K, T)."""
    camera, field = run.camera, load_field(run.deformation)
    rest = camera.lift(xy[:, 0].astype(float), sampled(run.depth.z[:1].astype(float), xy[:, :1])[:, 0])
    counted = visible & (visible[:, 0] & np.isfinite(rest).all(1))[:, None]
    counted[:, 0] = False
    seen = from_start(xy)
    counted &= moving(seen, counted, counted.any(1))
    known = counted.any(1)
    start, away = camera.project(rest[known]), np.zeros(counted.shape)
    for t in range(1, camera.frames):
        carried = camera.project(displace(rest[known], field, t / camera.fps)) - start
        away[known, t] = np.linalg.norm(carried - seen[known, t], axis=-1)
    ours, still = (np.where(counted, d, 0).sum(1) for d in (away, np.linalg.norm(seen, axis=-1)))
    of = f"{OF_MOVING}, all frames in which they are seen, in the picture"
    words = {
        name: (
            ratio(ours, counted.sum(1)),
            "px",
            f"mean distance of where the field carries points from {what}, {of}",
        ),
        f"{name}_still": (ratio(still, counted.sum(1)), "px", f"the same of a scene that stands still: {of}"),
        f"{name}_share": (
            ratio(ours, still),
            "%",
            f"distance from {what} as a share of that of a still scene: {of}",
        ),
    }
    return {
        name: ranged(found, unit, how, factor=100 if unit == "%" else 1, why_not="no moving point is seen")
        for name, (found, unit, how) in words.items()
    }


def _of_neighbours(run: Run | OfScene) -> dict[str, dict[str, Any]]:
    """How the surface's splats move beside each other."""
    found = surface_moved(run)
    if found is None:
        return {}
    of = f"opaque splats, {len(found.strain)} frames evenly through the clip"
    apart = f"|ln| of the distance of {NEIGHBOURS} neighbours over that at rest, 95th percentile: {of}"
    over = f"triangles between neighbours in the picture that are turned over, in the worst frame: {of}"
    return {
        "strain_95": number(np.percentile(found.strain, 95), "1", apart),
        "folded": number(100 * found.turned.mean(), "%", over),
    }


@dataclass(frozen=True)
class SurfaceMoved:
    """The opaque splats of a scene, and where its field carries them."""

    strain: np.ndarray
    """|ln| of the distance of neighbours over that at rest, (T', N, K), in FRAMES frames [1]."""
    worst: int
    """The frame in which most triangles are turned over."""
    pixel: np.ndarray
    """Where splats are in that frame, (N, 2) [px]."""
    corners: np.ndarray
    """Triangles between neighbours in the picture at rest, (M, 3)."""
    turned: np.ndarray
    """Whether each triangle is turned over in that frame, (M,)."""
    apart: np.ndarray
    """Each splat's mean strain in that frame, (N,) [1]."""


def surface_moved(run: Run | OfScene) -> SurfaceMoved | None:
    """None where there are too few opaque splats to have neighbours."""
    scene, camera, field = run.scene, run.camera, load_field(run.deformation)
    rest = scene.mean[expit(scene.opacity) > OPAQUE].astype(float)
    if len(rest) <= NEIGHBOURS:
        return None
    pairs = cKDTree(rest).query(rest, NEIGHBOURS + 1)[1][:, 1:]
    corners = Delaunay(camera.project(rest)).simplices
    # Slivers turn over by rounding alone.
    corners = corners[abs(_areas(camera.project(rest), corners)) > SLIVER]
    length, area = _lengths(rest, pairs), _areas(camera.project(rest), corners)
    frames = np.unique(np.linspace(0, camera.frames - 1, FRAMES).round().astype(int))
    strain, folded = [], []
    for t in frames:
        now = displace(rest, field, t / camera.fps)
        strain.append(abs(np.log(np.maximum(_lengths(now, pairs), TINY) / np.maximum(length, TINY))))
        folded.append((_areas(camera.project(now), corners) * area < 0).mean())
    k = int(np.argmax(folded))
    pixel = camera.project(displace(rest, field, frames[k] / camera.fps))
    turned = _areas(pixel, corners) * area < 0
    return SurfaceMoved(np.array(strain), int(frames[k]), pixel, corners, turned, strain[k].mean(1))


def _at_rest(run: Run | OfScene) -> dict[str, dict[str, Any]]:
    """Splats of the canonical scene that lie before the surface, or stick out of it."""
    scene, z = run.scene, run.depth.z[0].astype(float)
    row, column = np.clip(run.camera.project(scene.mean.astype(float))[:, ::-1].T, 0, np.array(z.shape)[:, None] - 1)
    surface = map_coordinates(z, [row, column], order=1)
    opacity, radii = expit(scene.opacity.astype(float)), np.exp(scene.scale.astype(float))
    longest, side = radii.max(1), np.ptp(np.percentile(scene.mean, [0.5, 99.5], axis=0), axis=0).max()
    floats = scene.mean[:, 2] < (1 - BEFORE) * surface
    before = f"share of all opacity that lies before the depth of frame 0 by more than {BEFORE:.0%} of its distance"
    long = f"splats whose longest radius is over {SPIKE:g} times the median one"
    most = "longest radius of any splat, over the longest side of the box that holds 99 % of the centres"
    return {
        "floating": number(100 * opacity[floats].sum() / opacity.sum(), "%", before),
        "spikes": number(100 * (longest > SPIKE * np.median(longest)).mean(), "%", long),
        "largest": number(100 * longest.max() / side, "%", most),
        "stretch": number((longest / radii.min(1)).max(), "1", "longest radius over the shortest, of the worst splat"),
    }


def _lengths(points: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Distances of points (N, 3) to others (N, K), (N, K)."""
    return np.linalg.norm(points[pairs] - points[:, None], axis=-1)


def _areas(pixels: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Twice the signed areas of triangles (M, 3) of places (N, 2), (M,)."""
    (ax, ay), (bx, by) = ((pixels[b] - pixels[a]).T for a, b in pairwise(corners.T))
    return ax * by - ay * bx
