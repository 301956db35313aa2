"""Closed triangle meshes: what a recording's body is bounded by."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from surgisim.problem import Problem


@dataclass(frozen=True)
class Mesh:
    vertices: np.ndarray
    """[m], (V, 3)."""
    faces: np.ndarray
    """Vertex indices, counter-clockwise seen from outside, (F, 3) int."""

    def __post_init__(self) -> None:
        if self.vertices.ndim != 2 or self.vertices.shape[1] != 3 or self.faces.ndim != 2 or self.faces.shape[1] != 3:
            raise Problem(
                f"mesh: shapes {self.vertices.shape} and {self.faces.shape} do not fit; (V, 3) and (F, 3) are wanted."
            )

    @property
    def volume(self) -> float:
        """Enclosed volume [m^3], negative where the faces look inwards (divergence theorem)."""
        a, b, c = np.moveaxis((self.vertices - self.vertices.mean(0))[self.faces], 1, 0)
        return float((np.cross(a, b) * c).sum() / 6)

    @property
    def area(self) -> float:
        """[m^2]"""
        a, b, c = np.moveaxis(self.vertices[self.faces], 1, 0)
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def closed(mesh: Mesh, where: str) -> Mesh:
    """The mesh with equal vertices merged and its faces looking outwards.

    Raises Problem, starting with `where`, if it does not enclose a volume: a hole, faces that turn
    different ways, no thickness, an index or a number that is none. Several pieces and hollows are allowed.
    """
    if not len(mesh.faces):
        raise Problem(f"{where}: holds no triangle, but the body's closed surface is wanted.")
    if not np.isfinite(mesh.vertices).all():
        raise Problem(f"{where}: a vertex is not a finite number. Export the mesh again.")
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        wrong = int(mesh.faces.max() if mesh.faces.max() >= len(mesh.vertices) else mesh.faces.min())
        raise Problem(f"{where}: a face names vertex {wrong}, but there are {len(mesh.vertices)}. Export it again.")
    vertices, index = np.unique(mesh.vertices, axis=0, return_inverse=True)
    faces = index.reshape(-1)[mesh.faces]
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(1)]
    _check_edges(vertices, faces, where)
    mesh = Mesh(vertices, faces)
    size = np.ptp(vertices, axis=0).max()
    if abs(mesh.volume) < 1e-9 * size * mesh.area:
        raise Problem(
            f"{where}: encloses no volume (a sheet seen from both sides). Pass the closed surface of the thick body."
        )
    return mesh if mesh.volume > 0 else Mesh(vertices, faces[:, ::-1])


def _check_edges(vertices: np.ndarray, faces: np.ndarray, where: str) -> None:
    """On a closed surface every edge is walked as often one way as the other."""
    edges = np.concatenate([faces, np.roll(faces, -1, axis=1)], 1).reshape(-1, 2, 3).swapaxes(1, 2).reshape(-1, 2)
    forward = edges[:, 0] < edges[:, 1]
    unique, index = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    balance = np.bincount(index.reshape(-1), np.where(forward, 1.0, -1.0), len(unique))
    count = np.bincount(index.reshape(-1), minlength=len(unique))
    if not balance.any():
        return
    at = np.round(vertices[unique[np.flatnonzero(balance)[0]]].mean(0), 5).tolist()
    turned = int((count[balance != 0] % 2 == 0).sum())
    if turned == np.count_nonzero(balance):
        raise Problem(
            f"{where}: neighbouring faces turn different ways at {turned} edges, the first near {at} m. "
            "Orient all faces outwards."
        )
    raise Problem(
        f"{where}: is not closed: {np.count_nonzero(balance)} of its edges have a face on one side only, the first "
        f"near {at} m. Pass the closed surface of the thick body."
    )


def read_stl(path: Path, *, unit: float) -> Mesh:
    """Triangles of a binary STL; `unit` is the length of one of its units [m]. Equal corners are merged."""
    raw = path.read_bytes()
    count = int.from_bytes(raw[80:84], "little") if len(raw) >= 84 else -1
    if len(raw) != 84 + 50 * count:
        raise Problem(f"{path}: is not a binary STL. Convert it, or write the mesh as PLY.")
    record = np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("attribute", "<u2")])
    corners = np.frombuffer(raw, record, count, 84)["corner"].reshape(-1, 3)
    vertices, index = np.unique(corners, axis=0, return_inverse=True)
    return Mesh(vertices.astype(float) * unit, index.reshape(-1, 3))
