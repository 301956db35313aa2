"""The scene continued beyond the picture's edge, so that no black border opens where tissue is drawn inward."""

from itertools import product

import numpy as np
from scipy.spatial.transform import Rotation

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.scene import Scene

WIDTH = 0.1
"""How far it is continued [longer image side]."""


def beyond(scene: Scene, camera: Camera, width: float = WIDTH) -> Scene:
    """Mirror images, outside of the picture, of the Gaussians that lie within `width` of its edges.

    Nothing is known of what lies there; a mirror image at the same depth has the edge's colours and texture, and no
    step. They are for where the scene itself leaves a hole: its own splats were fitted without them.
    """
    pixels, z = camera.project(scene.mean.astype(float)), scene.mean[:, 2].astype(float)
    last = np.array([camera.width, camera.height]) - 1.0
    reach = width * max(camera.width, camera.height)
    parts = []
    for side in map(np.array, product((-1, 0, 1), repeat=2)):
        # Distance inward from the mirror, half a pixel outside of the last one.
        inward = np.where(side < 0, pixels + 0.5, last + 0.5 - pixels)
        near = ((side == 0) | ((inward >= 0) & (inward < reach))).all(1) & side.any()
        mirrored = pixels + 2 * side * inward
        parts.append((np.flatnonzero(near), mirrored[near], np.where(side == 0, 1.0, -1.0)))
    mean, rotation = [], []
    for index, pixel, flip in parts:
        mean.append(camera.lift(pixel, z[index]))
        rotation.append(_flipped(scene.rotation[index], flip))
    source = np.concatenate([index for index, _, _ in parts])
    return Scene(
        mean=np.concatenate(mean).astype(np.float32),
        opacity=scene.opacity[source],
        scale=scene.scale[source],
        rotation=np.concatenate(rotation).astype(np.float32),
        color=scene.color[source],
    )


def _flipped(rotation: np.ndarray, flip: np.ndarray) -> np.ndarray:
    """Quaternions (G, 4) of ellipsoids mirrored in x and y where `flip` (2,) is -1."""
    if (flip > 0).all() or len(rotation) == 0:
        return rotation
    axes = Rotation.from_quat(rotation.astype(float), scalar_first=True).as_matrix() * np.append(flip, 1.0)[:, None]
    axes[:, :, 0] *= np.prod(flip)
    return Rotation.from_matrix(axes).as_quat(scalar_first=True)
