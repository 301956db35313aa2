"""A clip that went through the graph, as a recording: what the diagnosis of a video looks at."""

import numpy as np
from scipy.ndimage import gaussian_filter
from skimage.measure import marching_cubes

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.doubts import Doubts
from surgisim.artifacts.fit import Fit
from surgisim.artifacts.frames import AFTER, Frames
from surgisim.artifacts.material import Material
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.physics import Physics
from surgisim.artifacts.tracks import Tracks
from surgisim.estimation.observation import MEASURED
from surgisim.problem import Problem
from surgisim.recordings.mesh import Mesh, closed
from surgisim.recordings.recording import Recording

FINE = 0.5
"""Width of a voxel of the body's surface over the body's spacing."""
FITTED = 0.7
"""Share of the frames that are fitted where none were held out after them."""
HALF = 0.5
"""Tissue over a voxel on the surface."""
ASTRAY = 0.06
"""Of how far a point has gone across the view, how far its track is off, beside what the tracker says of it: of 18
clips of family 27182 .03 to .07 (root mean square outside the grips)."""
MARGIN = 4
"""Empty voxels around the body."""


def recording_of(
    name: str, body: Body, material: Material, physics: Physics, tracks: Tracks, motion: Motion, frames: Frames,
    camera: Camera, doubts: Doubts, fit: Fit,
) -> Recording:  # fmt: skip
    """Tracked points, grips, body and held boundary of a clip, in the camera's frame.

    A point's noise is what the tracker says of it across and along its own view. Frames held out after the fitted ones
    are held out here too; those between are fitted. Raises Problem where no point was seen in frame 0.
    """
    first = tracks.xyz[:, 0]
    kept = np.isfinite(first).all(1) & tracks.visible[:, 0]
    if not kept.any():
        raise Problem(f"clip {name}: no tracked point has a depth in frame 0, so none can be followed on the body.")
    points = tracks.xyz[kept]
    visible = tracks.visible[kept] & np.isfinite(points).all(-1)
    across, along = np.nanmedian(np.where(visible[..., None], tracks.sigma_xyz[kept].astype(float), np.nan), axis=1).T
    # A guess is no measurement, however far off it is said to be: its error is one for all points.
    along = np.where(along < MEASURED * points[:, 0, 2], along, points[:, 0, 2])
    noise = np.stack([across, across, along], -1)
    sigma = np.sqrt((noise**2).mean(1))
    after = np.flatnonzero(frames.split == AFTER)
    total = len(frames.split)
    until = int(after[0]) if len(after) else round(FITTED * total)
    split = {"fit": (0, until), "held_out": (until, total)}
    return Recording(
        name=name,
        fps=camera.fps,
        mesh=surface(body),
        boxes=held_boxes(body, material.held),
        points=np.where(visible[..., None], points, np.nan).astype(np.float32),
        visible=visible,
        sigma=sigma,
        motion=motion,
        density=physics.density,
        tier="video",
        place=points[:, 0].astype(float),
        axes=noise / sigma[:, None],
        ways=rays(points[:, 0].astype(float)),
        doubts={str(name): moved[kept].astype(float) for name, moved in zip(doubts.names, doubts.moved, strict=True)},
        astray=ASTRAY,
        expected=expected_of(fit),
        split=split,
        torn=body.torn,
    )


def expected_of(fit: Fit) -> dict[str, tuple[float, float]]:
    """90 % intervals of the base's "E" [Pa] and "eta / E" [s], as far as a fit has them; of the first law with one."""
    found = {}
    for name, one in fit.identifiability.items():
        parts = [part.rpartition(".")[2] for part in name.split(" / ")]
        known = {("E",): "E", ("eta", "E"): "eta / E"}.get(tuple(parts))
        if known and one["low"] > 0 and not one["at_edge"]:
            found.setdefault(known, (float(one["low"]), float(one["high"])))
    return found


def rays(points: np.ndarray) -> np.ndarray:
    """Two directions across the view of each point, the first level with the picture, and that along it, (K, 3, 3).

    points: camera frame [m], (K, 3).
    """
    along = points / np.linalg.norm(points, axis=1, keepdims=True)
    right = np.cross([0.0, 1.0, 0.0], along)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    return np.stack([right, np.cross(along, right), along], 1)


def surface(body: Body) -> Mesh:
    """The closed surface on which half of a voxel's worth of tissue lies within a voxel's reach."""
    share, low, width = _share(body)
    vertices, faces, _, _ = marching_cubes(share, HALF)
    # A voxel's number belongs to its middle.
    return closed(Mesh(low + (vertices + 0.5) * width, faces.astype(int)), "the clip's body")


def held_boxes(body: Body, held: np.ndarray) -> np.ndarray:
    """Voxels inside the surface in which most particles are held, joined along z [m], (B, 2, 3)."""
    share, low, width = _share(body)
    flat = np.ravel_multi_index(_cells(body, low, width).T, share.shape)
    count = np.bincount(flat, minlength=share.size)
    mostly = (np.bincount(flat, held, share.size) > 0.5 * np.maximum(count, 1)).reshape(share.shape) & (share > HALF)
    steps = np.diff(np.pad(mostly.astype(int), ((0, 0), (0, 0), (1, 1))), axis=2)
    begin, end = np.argwhere(steps == 1), np.argwhere(steps == -1)
    corner = np.stack([begin, np.concatenate([end[:, :2] + 1, end[:, 2:]], 1)], 1)
    return low + corner * width


def _share(body: Body) -> tuple[np.ndarray, np.ndarray, float]:
    """Tissue within reach of every voxel over the voxel, (X, Y, Z) [1], the voxels' corner, (3,) [m], and width [m]."""
    width = FINE * body.spacing
    low = body.rest.min(0).astype(float) - (MARGIN + 0.5) * width
    cells = _cells(body, low, width)
    shape = tuple(cells.max(0) + 1 + MARGIN)
    volume = np.bincount(np.ravel_multi_index(cells.T, shape), body.volume.astype(float), np.prod(shape))
    return gaussian_filter(volume.reshape(shape) / width**3, 1.0), low, width


def _cells(body: Body, low: np.ndarray, width: float) -> np.ndarray:
    """Voxel of every particle, (N, 3)."""
    return np.floor((body.rest.astype(float) - low) / width).astype(int)
