"""A closed mesh as a body of particles."""

import numpy as np

from surgisim.artifacts.body import Body
from surgisim.problem import Problem
from surgisim.recordings.inside import winding
from surgisim.recordings.mesh import Mesh

SAMPLES = 4
"""Points along each axis by which a particle's share of the body is counted."""
LEAST = 1 / 8
"""Share of its place below which a particle is left out."""
AGREES = 0.05
"""Largest difference between the counted and the enclosed volume."""
COLOR = (0.8, 0.75, 0.7)


def fill(
    mesh: Mesh, *, spacing: float, boxes: np.ndarray | None = None, per_axis: int = 2, where: str = "rest.ply"
) -> Body:
    """Particles of a closed mesh for a grid of `spacing` [m], `per_axis`^3 a cell, those in `boxes` held.

    boxes: lower and upper corners of what does not move, rest space [m], (B, 2, 3). A particle is held where a
    box covers it; a box too thin to cover any holds the layer it touches. Particles stand at the middle of the
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
    share, center = _shares(mesh, low, pitch, count)
    counted = share.sum() * pitch.prod()
    if abs(counted / mesh.volume - 1) > AGREES:
        raise Problem(
            f"{where}: its faces enclose {mesh.volume:.3g} m^3, but {counted:.3g} m^3 lie inside: the surface cuts "
            "through itself or is too fine for this grid. Mend the mesh, or take a finer grid."
        )
    kept = share > LEAST
    rest = center[kept]
    volume = share[kept] * (mesh.volume / share[kept].sum())
    return Body(
        rest=rest.astype(np.float32),
        volume=volume.astype(np.float32),
        color=np.tile(np.float32(COLOR), (len(rest), 1)),
        surface=_rim(kept)[kept],
        held=_held(rest, pitch, np.zeros((0, 2, 3)) if boxes is None else boxes, low, high),
        spacing=spacing,
    )


def _shares(mesh: Mesh, low, pitch, count) -> tuple[np.ndarray, np.ndarray]:
    """How much of every place is body, (X, Y, Z), and the middle of that part [m], (X, Y, Z, 3)."""
    axes = [low[d] + (np.arange(count[d] * SAMPLES) + 0.5) * pitch[d] / SAMPLES for d in range(3)]
    share, moment = np.zeros(count), np.zeros((*count, 3))
    # A slab of the body at a time: the samples of a large one would not fit.
    for k in range(count[0]):
        x = axes[0][k * SAMPLES : (k + 1) * SAMPLES]
        inside = (winding(mesh, x, axes[1], axes[2]) > 0).reshape(SAMPLES, count[1], SAMPLES, count[2], SAMPLES)
        share[k] = inside.mean((0, 2, 4))
        offset = [axes[1].reshape(1, count[1], SAMPLES, 1, 1), axes[2].reshape(1, 1, 1, count[2], SAMPLES)]
        moment[k, ..., 0] = (inside * x.reshape(-1, 1, 1, 1, 1)).mean((0, 2, 4))
        moment[k, ..., 1] = (inside * offset[0]).mean((0, 2, 4))
        moment[k, ..., 2] = (inside * offset[1]).mean((0, 2, 4))
    return share, moment / np.maximum(share, 1e-12)[..., None]


def _rim(kept: np.ndarray) -> np.ndarray:
    """Places with an empty neighbour."""
    padded = np.pad(kept, 1)
    full = np.ones_like(kept)
    for axis in range(3):
        for shift in (-1, 1):
            full &= np.roll(padded, shift, axis)[1:-1, 1:-1, 1:-1]
    return kept & ~full


def _held(rest: np.ndarray, pitch: np.ndarray, boxes: np.ndarray, low, high) -> np.ndarray:
    held = np.zeros(len(rest), bool)
    for b, (least, most) in enumerate(boxes):
        mine = ((rest >= least) & (rest <= most)).all(1)
        if not mine.any():
            mine = ((rest >= least - 0.51 * pitch) & (rest <= most + 0.51 * pitch)).all(1)
        if not mine.any():
            raise Problem(
                f"fixed.json: box {b} ({np.round(least, 4).tolist()} to {np.round(most, 4).tolist()} m) meets no part "
                f"of the body, which reaches from {np.round(low, 4).tolist()} to {np.round(high, 4).tolist()} m. "
                "Give boxes in the metres of rest.ply."
            )
        held |= mine
    if held.all():
        raise Problem(
            f"fixed.json: its boxes hold the whole body, which reaches from {np.round(low, 4).tolist()} to "
            f"{np.round(high, 4).tolist()} m, and nothing could move. Give boxes that cover only what is held."
        )
    return held
