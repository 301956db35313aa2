"""A surface lit from the camera looks as the closed form says, at rest and moved."""

import numpy as np
import pytest

from surgisim.artifacts.camera import Camera
from surgisim.lighting.headlight import log_brightness, log_brightness_change, to_linear, to_srgb
from surgisim.lighting.normals import at_pixels, rest_normals, turned
from surgisim.perception.depth.shading import Lattice, shading

CAMERA = Camera(64, 48, 70.0, 70.0, 31.5, 23.5, 25.0, 1, "known", "given", "made", [64, 48], [0, 0, 64, 48])
PIXELS = np.stack(np.meshgrid(np.arange(64.0), np.arange(48.0)), -1)


def sphere(center=0.08, radius=0.06):
    """Depth [m], (H, W), of a large sphere in front of the camera, and its unit normals."""
    ray = CAMERA.lift(PIXELS, np.ones((48, 64)))
    along, size = center * ray[..., 2], (ray**2).sum(-1)
    s = (along - np.sqrt(along**2 - size * (center**2 - radius**2))) / size
    points = s[..., None] * ray
    return s, (points - [0, 0, center]) / radius


def test_a_plane_that_comes_nearer_brightens_with_the_square_of_its_distance():
    rest, normal = np.array([[0.0, 0.0, 0.08]]), np.array([[0.0, 0.0, -1.0]])
    assert np.allclose(log_brightness_change(rest, normal, rest / 2, normal), np.log(4))


@pytest.mark.parametrize("ambient", [0.0, 0.1, 0.5])
def test_a_facet_that_turns_away_darkens_with_the_cosine_down_to_the_ambient_share(ambient):
    rest, normal, angle = np.array([0.0, 0.0, 0.08]), np.array([0.0, 0.0, -1.0]), np.radians(60)
    tilted, away = np.array([np.sin(angle), 0.0, -np.cos(angle)]), np.array([0.0, 0.0, 1.0])
    dark = log_brightness_change(rest, normal, rest, tilted, ambient)
    assert np.isclose(dark, np.log(ambient + (1 - ambient) / 2))
    if ambient:
        assert np.isclose(log_brightness_change(rest, normal, rest, away, ambient), np.log(ambient))


def test_depth_from_light_and_light_from_depth_are_one_model():
    z, normal = sphere()
    lattice = Lattice.of(CAMERA, 1.0)
    bright = log_brightness(CAMERA.lift(PIXELS, z), normal)
    inner = (slice(2, -2), slice(2, -2))
    assert np.allclose(bright[inner], -shading(lattice, np.log(z))[inner], atol=2e-3)


def test_normals_of_a_sphere_are_its_own_toward_the_camera():
    z, normal = sphere()
    found = rest_normals(z, CAMERA, spacing=1e-4)
    assert np.degrees(np.arccos((found * normal).sum(-1).clip(-1, 1)))[4:-4, 4:-4].max() < 1.5
    assert np.allclose(at_pixels(found, np.array([[10.0, 7.0]])), found[7, 10])


def test_a_sheared_plane_has_the_normal_of_where_its_points_went():
    F = np.array([[1.0, 0.2, 0.0], [0.0, 0.9, 0.1], [0.4, -0.3, 1.2]])
    normal = np.array([0.1, -0.3, -0.9])
    u, v = np.cross(normal, [1.0, 0, 0]), np.cross(normal, [0, 1.0, 0])
    moved = np.cross(F @ u, F @ v)
    assert np.allclose(np.cross(turned(F[None], normal[None])[0], moved), 0, atol=1e-12)
    assert turned(F[None], normal[None])[0] @ moved * (np.cross(u, v) @ normal) > 0


def test_linear_light_and_srgb_undo_each_other():
    level = np.linspace(0, 1, 256)
    assert np.allclose(to_srgb(to_linear(level)), level, atol=1e-6)
