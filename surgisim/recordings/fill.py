"""A closed mesh as a body of particles."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.body import Body
from surgisim.problem import Problem
from surgisim.recordings.inside import winding
from surgisim.recordings.mesh import Mesh

SAMPLES = 4
"""Points along each axis by which a particle's share of the body is counted."""
LEAST = 1 / 8
"""Share of its place below which a particle is left out."""
SLICE = 0.02
"""Share of a particle below which what is held of it, or free, goes with the other part."""
AGREES = 0.05
"""Largest difference between the counted and the enclosed volume."""
COLOR = (0.8, 0.75, 0.7)


def fill(
    mesh: Mesh, *, spacing: float, boxes: np.ndarray | None = None, per_axis: int = 2, where: str = "rest.ply"
) -> Body:
    """Particles of a closed mesh for a grid of `spacing` [m], `per_axis`^3 a cell, those in `boxes` held.

    boxes: lower and upper corners of what does not move, rest space [m], (B, 2, 3). A place that a box cuts has two
    particles, one for what is held of it and one for what is free, so that the held side ends where the box does,
    whatever the grid; a box thinner than a particle holds a plane. Particles stand at the middle of the
    tissue they stand for, and their volumes add up to the mesh's. `surface` marks the outermost layer.
    Raises Problem, starting with `where`, for a body thinner than a particle, one that overlaps itself, or a box that
    meets none of it.
    """
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    thickness = 2 * mesh.volume / mesh.area
    if thickness < spacing / per_axis:
        raise Problem(
            f"{where}: the body is about {thickness:.2g} m thick, too thin for particles {spacing / per_axis:.2g} m "
            "apart. Take a finer grid, or pass the surface of the thick body."
        )
    count = np.maximum(1, np.round((high - low) / (spacing / per_axis))).astype(int)
    pitch = (high - low) / count
    boxes = _met(np.zeros((0, 2, 3)) if boxes is None else np.asarray(boxes, float), low, high, pitch)
    whole, held = _shares(mesh, low, pitch, count, boxes)
    counted = whole.share.sum() * pitch.prod()
    if abs(counted / mesh.volume - 1) > AGREES:
        raise Problem(
            f"{where}: its faces enclose {mesh.volume:.3g} m^3, but {counted:.3g} m^3 lie inside: the surface cuts "
            "through itself or is too fine for this grid. Mend the mesh, or take a finer grid."
        )
    kept = whole.share > LEAST
    share = np.where(kept, whole.share, 0.0)
    holds = np.where(held.share > SLICE * np.maximum(share, 1e-12), np.minimum(held.share, share), 0.0) * kept
    frees = np.where(share - holds > SLICE * share, share - holds, 0.0)
    holds = np.where(frees > 0, holds, share)
    _check_held(boxes, held.of_box, holds, frees, low, high)
    free = (whole.moment - np.where(holds[..., None] > 0, held.moment, 0.0)) / np.maximum(frees, 1e-12)[..., None]
    part = (frees > 0) & (holds > 0)
    free = np.where(part[..., None], free, whole.center)
    fixed = np.where(part[..., None], held.center, whole.center)
    rest = np.concatenate([free[frees > 0], fixed[holds > 0]])
    volume = np.concatenate([frees[frees > 0], holds[holds > 0]]) * (mesh.volume / share.sum())
    rim = _rim(kept)
    return Body(
        rest=rest.astype(np.float32),
        volume=volume.astype(np.float32),
        color=np.tile(np.float32(COLOR), (len(rest), 1)),
        surface=np.concatenate([rim[frees > 0], rim[holds > 0]]),
        held=np.repeat([False, True], [(frees > 0).sum(), (holds > 0).sum()]),
        spacing=spacing,
    )


@dataclass(frozen=True)
class _Part:
    """What of every place of a lattice is tissue of some kind."""

    share: np.ndarray
    """(X, Y, Z)"""
    moment: np.ndarray
    """Share times the middle of it [m], (X, Y, Z, 3)."""
    of_box: np.ndarray
    """Share that each box holds, summed over places, (B,)."""

    @property
    def center(self) -> np.ndarray:
        return self.moment / np.maximum(self.share, 1e-12)[..., None]


def _shares(mesh: Mesh, low, pitch, count, boxes) -> tuple[_Part, _Part]:
    """Of all tissue, and of what boxes hold."""
    axes = [low[d] + (np.arange(count[d] * SAMPLES) + 0.5) * pitch[d] / SAMPLES for d in range(3)]
    fine = pitch / SAMPLES
    # Of every sample of an axis: the share of it that a box covers, and the middle of that.
    covers = [[_covered(axes[d], fine[d], box[:, d]) for d in range(3)] for box in boxes]
    share, moment = np.zeros(count), np.zeros((*count, 3))
    held, held_moment, of_box = np.zeros(count), np.zeros((*count, 3)), np.zeros(len(boxes))

    def gathered(samples: np.ndarray) -> np.ndarray:
        return samples.reshape(SAMPLES, count[1], SAMPLES, count[2], SAMPLES).mean((0, 2, 4))

    # A slab of the body at a time: the samples of a large one would not fit.
    for k in range(count[0]):
        mine = slice(k * SAMPLES, (k + 1) * SAMPLES)
        inside = (winding(mesh, axes[0][mine], axes[1], axes[2]) > 0).astype(float)
        middle = np.meshgrid(axes[0][mine], axes[1], axes[2], indexing="ij")
        share[k] = gathered(inside)
        moment[k] = np.stack([gathered(inside * m) for m in middle], -1)
        most, at = np.zeros_like(inside), np.zeros((*inside.shape, 3))
        for b, cover in enumerate(covers):
            (x, xm), (y, ym), (z, zm) = (cover[0][0][mine], cover[0][1][mine]), cover[1], cover[2]
            weight = inside * x[:, None, None] * y[None, :, None] * z[None, None]
            of_box[b] += weight.sum() / SAMPLES**3
            more = weight > most
            at[more] = np.stack(np.meshgrid(xm, ym, zm, indexing="ij"), -1)[more]
            most = np.maximum(most, weight)
        held[k] = gathered(most)
        held_moment[k] = np.stack([gathered(most * at[..., d]) for d in range(3)], -1)
    return _Part(share, moment, np.zeros(0)), _Part(held, held_moment, of_box)


def _covered(middle: np.ndarray, width: float, span: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of samples of an axis around `middle` [m], (N,): the share within a span, and the middle of that [m]."""
    low, high = np.maximum(middle - width / 2, span[0]), np.minimum(middle + width / 2, span[1])
    return np.clip((high - low) / width, 0, 1), np.where(high > low, (low + high) / 2, middle)


def _met(boxes: np.ndarray, low: np.ndarray, high: np.ndarray, pitch: np.ndarray) -> np.ndarray:
    """Boxes as planes are taken to be: at least a slice of a particle thick, and touching what they nearly touch."""
    least = 2 * SLICE * pitch
    boxes = boxes.copy()
    # A box that ends at the body's skin, or a little beyond it, holds that skin.
    boxes[:, 0] = np.where(
        (boxes[:, 0] > high - least) & (boxes[:, 0] < high + 0.51 * pitch), high - least, boxes[:, 0]
    )
    boxes[:, 1] = np.where((boxes[:, 1] < low + least) & (boxes[:, 1] > low - 0.51 * pitch), low + least, boxes[:, 1])
    thin = np.maximum(least - (boxes[:, 1] - boxes[:, 0]), 0) / 2
    return np.stack([boxes[:, 0] - thin, boxes[:, 1] + thin], 1)


def _rim(kept: np.ndarray) -> np.ndarray:
    """Places with an empty neighbour."""
    padded = np.pad(kept, 1)
    full = np.ones_like(kept)
    for axis in range(3):
        for shift in (-1, 1):
            full &= np.roll(padded, shift, axis)[1:-1, 1:-1, 1:-1]
    return kept & ~full


def _check_held(boxes, of_box, holds, frees, low, high) -> None:
    for b, (least, most) in enumerate(boxes):
        if not of_box[b] > 0:
            raise Problem(
                f"fixed.json: box {b} ({np.round(least, 4).tolist()} to {np.round(most, 4).tolist()} m) meets no part "
                f"of the body, which reaches from {np.round(low, 4).tolist()} to {np.round(high, 4).tolist()} m. "
                "Give boxes in the metres of rest.ply."
            )
    if len(boxes) and not (frees > 0).any():
        raise Problem(
            f"fixed.json: its boxes hold the whole body, which reaches from {np.round(low, 4).tolist()} to "
            f"{np.round(high, 4).tolist()} m, and nothing could move. Give boxes that cover only what is held."
        )
    if len(boxes) and not (holds > 0).any():
        raise Problem(
            "fixed.json: its boxes hold less than a fiftieth of every particle they touch. Give boxes that cover what "
            "is held."
        )
