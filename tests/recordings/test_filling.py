"""A closed mesh becomes particles that weigh and balance as the solid does."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from solids import ball, box, hull, joined, ring

from surgisim.problem import Problem
from surgisim.recordings.fill import fill
from surgisim.recordings.inside import winding
from surgisim.recordings.mesh import Mesh, closed, read_stl

SPACING = 0.005


def turned(mesh: Mesh, seed: int) -> Mesh:
    return Mesh(mesh.vertices @ Rotation.random(rng=seed).as_matrix().T + 0.05, mesh.faces)


@pytest.mark.parametrize("solid", [box, ball, ring])
@pytest.mark.parametrize("seed", [0, 1])
def test_volume_is_exact_and_the_middle_in_its_place(solid, seed):
    mesh = closed(turned(solid(), seed), "solid")
    body = fill(mesh, spacing=SPACING)
    assert body.volume.sum() == pytest.approx(mesh.volume, rel=1e-5)
    middle = (body.rest * body.volume[:, None]).sum(0) / body.volume.sum()
    assert np.abs(middle - center(mesh)).max() < 0.02 * SPACING


def center(mesh: Mesh) -> np.ndarray:
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    part = (np.cross(a, b) * c).sum(1) / 6
    return ((a + b + c) / 4 * part[:, None]).sum(0) / part.sum()


def test_a_cell_holds_about_eight_particles():
    body = fill(closed(ring(), "ring"), spacing=0.004)
    assert 7.5 < len(body.rest) * 0.004**3 / body.volume.sum() < 10


def test_a_box_along_the_axes_is_tiled_without_a_seam():
    body = fill(closed(box(), "box"), spacing=SPACING)
    assert len(body.rest) == 16 * 12 * 8
    assert np.ptp(body.volume) < 1e-6 * body.volume[0]
    assert body.surface.sum() == 16 * 12 * 8 - 14 * 10 * 6


def test_rays_through_edges_and_corners_are_counted_once():
    mesh = closed(box((1.0, 1.0, 1.0)), "box")
    at = np.linspace(-0.25, 1.25, 7)  # through corners, along edges and across diagonals
    inside = winding(mesh, at, at, np.array([-0.1, 0.4, 1.1]))
    assert set(np.unique(inside)) == {0, 1}
    assert not inside[:, :, [0, 2]].any()
    assert inside[2:5, 2:5, 1].all()
    assert not inside[[0, -1], :, 1].any()
    assert not inside[:, [0, -1], 1].any()


def test_a_ray_through_a_peak_enters_once_and_leaves_once():
    peaks = hull(np.concatenate([np.eye(3), -np.eye(3)]))
    assert winding(peaks, np.zeros(1), np.zeros(1), np.array([-1.5, -0.5, 0.5, 1.5])).ravel().tolist() == [0, 1, 1, 0]


def test_the_hollow_of_a_shell_stays_empty():
    outer, inner = ball(0.02), ball(0.01)
    shell = closed(joined(outer, Mesh(inner.vertices, inner.faces[:, ::-1])), "shell")
    body = fill(shell, spacing=0.004)
    assert np.linalg.norm(body.rest, axis=1).min() > 0.0095


def test_a_mesh_that_looks_inwards_is_turned():
    inwards = Mesh(box().vertices, box().faces[:, ::-1])
    assert closed(inwards, "box").volume == pytest.approx(box().volume)


def test_doubled_corners_are_one_corner():
    soup = Mesh(box().vertices[box().faces].reshape(-1, 3), np.arange(36).reshape(12, 3))
    assert len(closed(soup, "box").vertices) == 8


def one_face_turned() -> Mesh:
    faces = box().faces.copy()
    faces[0] = faces[0][::-1]
    return Mesh(box().vertices, faces)


def sheet() -> Mesh:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    return Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3], [2, 1, 0], [3, 2, 0]]))


@pytest.mark.parametrize(
    ("mesh", "told"),
    [
        (Mesh(box().vertices, box().faces[1:]), "not closed: 3 of its edges"),
        (one_face_turned(), "turn different ways at 3 edges"),
        (sheet(), "encloses no volume"),
        (Mesh(box().vertices, box().faces + 1), "names vertex 8, but there are 8"),
        (Mesh(np.where(box().vertices > 0.035, np.nan, box().vertices), box().faces), "not a finite number"),
        (Mesh(box().vertices, np.zeros((0, 3), int)), "holds no triangle"),
    ],
)
def test_a_mesh_that_bounds_nothing_is_refused(mesh, told):
    with pytest.raises(Problem, match=told):
        closed(mesh, "rest.ply")


def test_a_thin_plate_is_refused_at_a_coarse_grid():
    plate = closed(box((0.04, 0.04, 0.001)), "plate")
    with pytest.raises(Problem, match="too thin for particles"):
        fill(plate, spacing=SPACING)
    assert len(fill(plate, spacing=0.001).rest) > 1000


def test_a_body_that_overlaps_itself_is_refused():
    twice = closed(joined(box(), Mesh(box().vertices + 0.005, box().faces)), "two boxes")
    with pytest.raises(Problem, match="cuts through itself"):
        fill(twice, spacing=SPACING)


def test_a_box_holds_what_it_covers_and_a_thin_one_the_layer_it_touches():
    mesh = closed(box(), "box")
    thick, thin = (np.array([[[-1, -1, -1e-4], [1, 1, top]]]) for top in (0.004, 1e-4))
    held = [fill(mesh, spacing=SPACING, boxes=b).held.sum() for b in (thick, thin)]
    assert held == [2 * 16 * 12, 16 * 12]


def test_a_box_beside_the_body_is_refused():
    with pytest.raises(Problem, match=r"box 0 .* meets no part"):
        fill(closed(box(), "box"), spacing=SPACING, boxes=np.array([[[1.0, 1, 1], [2, 2, 2]]]))


def test_boxes_around_the_whole_body_are_refused():
    with pytest.raises(Problem, match="its boxes hold the whole body"):
        fill(closed(box(), "box"), spacing=SPACING, boxes=np.array([[[-1.0, -1, -1], [1, 1, 1]]]))


def test_a_binary_stl_is_read_in_its_unit(tmp_path):
    mesh = box((40.0, 30.0, 20.0))
    record = np.zeros(12, [("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
    record["c"] = mesh.vertices[mesh.faces]
    path = tmp_path / "box.stl"
    path.write_bytes(bytes(80) + np.uint32(12).tobytes() + record.tobytes())
    assert closed(read_stl(path, unit=1e-3), "box").volume == pytest.approx(box().volume, rel=1e-6)
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(Problem, match="not a binary STL"):
        read_stl(path, unit=1e-3)
