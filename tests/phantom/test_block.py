"""The driven ball of tissue is the same whatever the mesh."""

import numpy as np
import pytest
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import ConvexHull
from tissue_pieces import slab

from surgisim.phantom import march as march_module
from surgisim.phantom.block import mesh
from surgisim.phantom.elements import elements
from surgisim.phantom.law import Law
from surgisim.phantom.march import Drive, march
from surgisim.phantom.timeline import ease
from surgisim.problem import Problem

HILLS = np.array([[200.0, 90.0, 0.4, 0.001], [-120.0, 210.0, 2.0, 0.0008]])


@pytest.mark.parametrize(("spacing", "close"), [(0.0025, 0.03), (0.0020, 0.01), (0.0015, 0.01)])
def test_the_driven_volume_does_not_depend_on_the_mesh(spacing, close):
    shape, grip = slab()
    block = mesh(shape, grip, spacing, hold_sides=False)
    assert ConvexHull(block.points[block.gripped]).volume == pytest.approx(2 / 3 * np.pi * grip.radius**3, rel=close)


@pytest.mark.parametrize("spacing", [0.0028, 0.0019])
def test_no_lattice_edge_crosses_the_sphere_but_at_a_node(spacing):
    shape, grip = slab(waves=HILLS)
    block = mesh(shape, grip, spacing, hold_sides=False)
    away = np.linalg.norm(block.points - shape.upper(grip.uv), axis=1)
    away = away / away[block.gripped].max() - 1
    edges = np.concatenate([block.cells[:, pair] for pair in ([0, 1], [0, 2], [0, 4], [3, 7], [5, 7], [6, 7])])
    assert not ((away[edges].min(1) < -1e-6) & (away[edges].max(1) > 1e-6)).any()
    assert (away[block.gripped] < 1e-6).all()
    assert (away[~block.gripped] > 1e-6).all()


def test_upper_nodes_lie_on_the_hills():
    shape, grip = slab(waves=HILLS)
    block = mesh(shape, grip, 0.0025, hold_sides=False)
    upper = np.unique(block.triangles[: len(block.triangles) // 3])
    gap = np.abs(block.points[:, 2] - shape.upper(block.uv)[:, 2])
    layer = np.sort(gap)[: len(upper)]
    assert layer.max() < 1e-9


def test_the_field_around_the_grip_converges():
    probe = np.stack(np.meshgrid([-0.012, -0.010, 0.010, 0.012], [-0.010, 0.001, 0.010]), -1).reshape(-1, 2)
    fields = []
    for spacing in (0.0028, 0.0021):
        shape, grip = slab(half=0.016)
        block = mesh(shape, grip, spacing, hold_sides=False)
        law = Law(E=1000.0, nu=0.45, eta=6.0, density=1050.0)
        pull = np.array([0.003, 0.0, -0.003])
        drive = Drive(lambda t, pull=pull: ease(t / 0.10)[:, None] * pull, -1.0, 9.0)
        moved = march(block, elements(block.points, block.cells, law), drive, np.linspace(0, 0.16, 6))[-1]
        assert np.allclose((moved - block.points)[block.gripped], pull, atol=1e-12)
        assert not (moved - block.points)[block.fixed].any()
        upper = np.abs(block.points[:, 2] - 0.07) < 1e-9
        fields.append(LinearNDInterpolator(block.points[upper, :2], (moved - block.points)[upper])(probe))
    size, gap = (np.sqrt((f**2).sum(-1).mean()) for f in (fields[1], fields[0] - fields[1]))
    assert size > 1e-3
    assert gap < 0.04 * size


def test_a_grip_that_reaches_the_base_is_refused():
    shape, grip = slab(thickness=0.006)
    with pytest.raises(Problem, match="grip_radius"):
        mesh(shape, grip, 0.0025, hold_sides=False)


def test_tissue_that_too_few_steps_blow_up_is_moved_with_more(monkeypatch):
    shape, grip = slab(half=0.016)
    block = mesh(shape, grip, 0.0028, hold_sides=False)
    parts = elements(block.points, block.cells, Law(E=1000.0, nu=0.45, eta=2.0, density=1050.0))
    drive = Drive(lambda t: ease(t / 0.05)[:, None] * np.array([0.002, 0.0, -0.002]), -1.0, 9.0)
    times = np.linspace(0, 0.06, 4)
    moved = march(block, parts, drive, times)
    stable = march_module.stable_step(block.points, parts, block.fixed)
    monkeypatch.setattr(march_module, "stable_step", lambda *_: 1.6 * stable / march_module.SAFETY)
    assert np.abs(march(block, parts, drive, times) - moved).max() < 2e-5
    monkeypatch.setattr(march_module, "FINER", 1)
    with pytest.raises(Problem, match=r"not finite|inside out"):
        march(block, parts, drive, times)
