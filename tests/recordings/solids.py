"""Closed surfaces and a small recording for tests."""

import numpy as np
from scipy.spatial import ConvexHull

from surgisim.artifacts.motion import Motion
from surgisim.recordings.mesh import Mesh, closed
from surgisim.recordings.recording import Recording


def box(size=(0.04, 0.03, 0.02)) -> Mesh:
    corners = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), -1).reshape(-1, 3) * np.array(size)
    return hull(corners)


def ball(radius=0.015, points=400) -> Mesh:
    direction = np.random.default_rng(3).normal(size=(points, 3))
    return hull(radius * direction / np.linalg.norm(direction, axis=1, keepdims=True))


def ring(large=0.02, small=0.008, around=48, across=24) -> Mesh:
    a, b = np.meshgrid(2 * np.pi * np.arange(around) / around, 2 * np.pi * np.arange(across) / across, indexing="ij")
    far = large + small * np.cos(b)
    vertices = np.stack([far * np.cos(a), far * np.sin(a), small * np.sin(b)], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    k = [((i + p) % around * across + (j + q) % across).ravel() for p, q in ((0, 0), (1, 0), (1, 1), (0, 1))]
    faces = np.concatenate([np.stack([k[0], k[1], k[2]], 1), np.stack([k[0], k[2], k[3]], 1)])
    return closed(Mesh(vertices, faces), "ring")


def hull(points: np.ndarray) -> Mesh:
    """Their convex hull, triangles looking outwards."""
    found = ConvexHull(points)
    faces = found.simplices.copy()
    a, b, c = np.moveaxis(points[faces], 1, 0)
    inwards = (np.cross(b - a, c - a) * found.equations[:, :3]).sum(1) < 0
    faces[inwards] = faces[inwards][:, ::-1]
    used = np.unique(faces)
    return Mesh(points[used], np.searchsorted(used, faces))


def joined(first: Mesh, second: Mesh) -> Mesh:
    return Mesh(
        np.concatenate([first.vertices, second.vertices]),
        np.concatenate([first.faces, second.faces + len(first.vertices)]),
    )


def recording(grips=1, frames=6, **changes) -> Recording:
    """A box held at its floor, four points on its roof, a grip that moves up."""
    center = np.tile([[0.02, 0.015, 0.02]], (grips, 1))
    position = center[:, None] + np.linspace(0, 0.003, frames)[:, None] * np.array([0.0, 0.0, 1.0])
    active = np.ones((grips, frames), bool)
    motion = Motion(center, np.full(grips, 0.006), position, active, np.ones(grips), "given" if grips else "none")
    points = np.array([[0.01, 0.01, 0.02], [0.03, 0.01, 0.02], [0.01, 0.02, 0.02], [0.03, 0.02, 0.02]])
    points = np.repeat(points[:, None], frames, 1).astype(np.float32)
    points[1, 2] = np.nan
    told = dict(
        name="r-1",
        fps=25.0,
        mesh=closed(box(), "box"),
        boxes=np.array([[[-0.001, -0.001, -0.001], [0.041, 0.031, 0.003]]]),
        points=points,
        visible=np.isfinite(points).all(-1),
        sigma=np.full(4, 3e-4),
        motion=motion,
        density=1050.0,
        gravity=(0.0, 0.0, -9.81),
        split={"fit": (0, 4), "held_out": (4, 6)},
    )
    return Recording(**(told | changes))
