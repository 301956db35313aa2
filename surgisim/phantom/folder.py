"""The recording as files, in the public format surgisim-recording/1, and the truth beside it.

Written with numpy and json alone: what reads recordings elsewhere is part of what the phantom tests.
"""

import io
import json

import numpy as np

from surgisim.phantom.model import Model
from surgisim.phantom.scene import Scene

MOUNT = 3e-3
"""Thickness of the plate that the base is stuck to; it is part of the rest shape and held still [m]."""
THIN = 3e-4
"""Thickness of the box around the base where no plate is recorded [m]."""


def recording(
    scene: Scene, name: str, seen: np.ndarray, visible: np.ndarray, sigma: float, rest: Model, *, plate: bool = True
) -> dict:
    """File name -> bytes. `plate`: whether the body stands on the plate that its base is stuck to.

    Nothing in them is shorter or longer for what is concealed: arrays are not compressed.
    """
    told = {
        "format": "surgisim-recording/1",
        "name": name,
        "fps": scene.fps,
        "frames": scene.frames,
        "length_unit": "m",
        "density_kg_m3": scene.law.density,
        "gravity_m_s2": scene.gravity.tolist(),
        "tier": "tracks",
        "starts": "settled",
    }
    clock = np.arange(scene.frames)
    center = np.stack([scene.shape.upper(h.grip.uv) for h in scene.holds])
    position = np.stack([c + h.path(clock) for c, h in zip(center, scene.holds, strict=True)])
    active = np.stack([(clock >= h.begin) & (clock <= h.release) for h in scene.holds])
    radius = np.array([h.grip.radius for h in scene.holds])
    points = np.where(visible[..., None], seen, np.nan).astype(np.float32)
    vertices, faces = surface(rest, MOUNT if plate else 0.0)
    span = {"fit": [0, scene.split], "held_out": [scene.split, scene.frames]}
    return {
        "recording.json": _json(told),
        "rest.ply": ply(vertices, faces),
        "fixed.json": _json({"boxes": [base(scene, plate)]}),
        "grip.npz": npz(center_rest=center, radius=radius, position=position, active=active),
        "tracks.npz": npz(points=points, visible=visible, sigma=np.full(len(points), sigma)),
        "split.json": _json(span),
    }


def base(scene: Scene, plate: bool = True) -> dict:
    """The box that holds the plate under the tissue, or the base alone, whichever way the block is turned."""
    reach = 1.01 * float(np.linalg.norm(scene.shape.high - scene.shape.low)) / 2
    top = scene.shape.center[2] - scene.shape.thickness
    below, above = (1.5 * MOUNT, 0.0) if plate else (THIN / 2, THIN / 2)
    low = [*(scene.shape.center[:2] - reach).tolist(), float(top - below)]
    return {"min": low, "max": [*(scene.shape.center[:2] + reach).tolist(), float(top + above)]}


def surface(model: Model, mount: float = MOUNT) -> tuple[np.ndarray, np.ndarray]:
    """Closed skin of the block and its plate of thickness `mount` [m], which may be 0.

    Vertices [m], (V, 3), and outward triangles, (F, 3).
    """
    cells, points = model.mesh.cells, model.mesh.points
    # Corners of the six sides, outward where xi, eta, zeta are right-handed.
    sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    quads = np.concatenate([cells[:, side] for side in sides])
    _, first, count = np.unique(np.sort(quads, axis=1), axis=0, return_index=True, return_counts=True)
    quads = quads[np.sort(first[count == 1])]
    if mount:
        points, quads = _on_plate(model, points, quads, mount)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    used, faces = np.unique(faces, return_inverse=True)
    faces, vertices = faces.reshape(-1, 3), points[used]
    a, b, c = np.moveaxis((vertices - vertices.mean(0))[faces], 1, 0)
    return vertices, faces if (np.cross(a, b) * c).sum() > 0 else faces[:, ::-1]


def _on_plate(model: Model, points: np.ndarray, quads: np.ndarray, mount: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and quads of the skin with a plate: the base's quads move down, and its rim is walled."""
    below = model.mesh.fixed[quads].all(1)
    lower = np.cumsum(model.mesh.fixed) - 1 + len(points)
    floor = points[model.mesh.fixed] - [0.0, 0.0, mount]
    edges = np.stack([quads[below], np.roll(quads[below], -1, 1)], -1).reshape(-1, 2)
    key = np.sort(edges, axis=1)
    _, at, count = np.unique(key, axis=0, return_index=True, return_counts=True)
    rim = edges[at[count == 1]]
    walls = np.stack([rim[:, 0], rim[:, 1], lower[rim[:, 1]], lower[rim[:, 0]]], 1)[:, ::-1]
    # A quad of the base, seen from below, turns the same way one plate lower; its old edge is a wall's upper one.
    return np.concatenate([points, floor]), np.concatenate([quads[~below], lower[quads[below]], walls[:, ::-1]])


def npz(**fields: np.ndarray) -> bytes:
    """Not compressed, so that a file's size says nothing of what is in it."""
    stream = io.BytesIO()
    np.savez(stream, **fields)
    return stream.getvalue()


def _json(body: dict) -> bytes:
    return (json.dumps(body, indent=1, allow_nan=False) + "\n").encode()


def ply(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    head += [f"property double {a}" for a in "xyz"]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    body = np.empty(len(faces), [("n", "u1"), ("v", "<i4", 3)])
    body["n"], body["v"] = 3, faces
    return ("\n".join(head) + "\n").encode() + vertices.astype("<f8").tobytes() + body.tobytes()
