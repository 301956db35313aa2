"""What the rasteriser says about the way back: its gradients against the twin's, and against differences."""

import pytest
import torch
from clouds import NAMES, TOLERANCE, camera, cloud, distance, one

from surgisim.gaussians.engine_gsplat import lacking
from surgisim.gaussians.rasterise import Image, rasterise

BACK = (0.2, 0.5, 0.7)


def loss(seen, parts=("rgb", "depth", "alpha")):
    """A fixed random weighing of every pixel."""
    draw = torch.Generator().manual_seed(1)
    total = 0
    for name, size in (("rgb", 1.0), ("depth", 20.0), ("alpha", 1.0)):
        image = getattr(seen, name)
        weight = size * torch.randn(image.shape, generator=draw, dtype=torch.float64).to(image)
        if name in parts:
            total = total + (weight.double() * image.double()).sum()
    return total


def gradients(scene, view, engine, dtype, parts=("rgb", "depth", "alpha"), device="cpu"):
    scene = [t.to(device, dtype).clone().requires_grad_() for t in scene]
    probe = torch.zeros(len(scene[0]), 2, dtype=dtype, device=device, requires_grad=True)
    loss(rasterise(*scene, view, background=BACK, engine=engine, probe=probe), parts).backward()
    found = (torch.zeros_like(t) if t.grad is None else t.grad for t in (*scene, probe))
    return dict(zip((*NAMES, "probe"), (g.cpu() for g in found), strict=True))


@pytest.mark.parametrize("parts", [("rgb",), ("depth",), ("alpha",), ("rgb", "depth", "alpha")])
@pytest.mark.parametrize("size", [(48, 32), (61, 47)])
def test_gradients_are_the_twins(size, parts):
    view = camera(*size)
    scene = cloud(200, view, seed=2)
    fast = gradients(scene, view, "numba", torch.float32, parts)
    slow = gradients(scene, view, "twin", torch.float64, parts)
    for name in fast:
        if slow[name].any():
            assert distance(fast[name], slow[name]) < TOLERANCE["backward"], name
        else:
            assert not fast[name].any(), name


def test_gradients_are_the_twins_where_layers_hide_each_other():
    view = camera(48, 32)
    scene = cloud(400, view, seed=3)
    scene[2], scene[3] = scene[2] * 4, 0.9 + 0.1 * scene[3]
    fast, slow = gradients(scene, view, "numba", torch.float32), gradients(scene, view, "twin", torch.float64)
    for name in fast:
        assert distance(fast[name], slow[name]) < TOLERANCE["backward"], name


def test_gradients_are_the_twins_at_the_edge_of_the_linearised_view():
    view = camera(48, 32)
    scene = one(view, at=(-40.0, 15.0), radius=60.0)
    fast, slow = gradients(scene, view, "numba", torch.float32), gradients(scene, view, "twin", torch.float64)
    assert distance(fast["mean"], slow["mean"]) < TOLERANCE["backward"]


@pytest.mark.parametrize("name", NAMES)
def test_gradients_are_central_differences(name):
    # Gaussians that reach over the whole image: where one falls to 1/255 the image jumps, which differences see and
    # derivatives do not.
    view = camera(32, 24)
    scene = cloud(6, view, seed=5)
    scene[2], scene[3] = 0.03 + 0.04 * scene[4], 0.4 + 0.5 * scene[3]
    at = NAMES.index(name)
    gradient = gradients(scene, view, "numba", torch.float32)[name].double()
    found = torch.zeros_like(gradient)
    for i in range(gradient.numel()):
        step = 5e-3 * float(scene[at].abs().mean())
        values = []
        for sign in (1, -1):
            moved = [t.clone() for t in scene]
            moved[at].view(-1)[i] += sign * step
            values.append((float(moved[at].view(-1)[i]), float(loss(rasterise(*moved, view, background=BACK)))))
        found.view(-1)[i] = (values[0][1] - values[1][1]) / (values[0][0] - values[1][0])
    assert distance(gradient, found) < TOLERANCE["differences"]


def test_what_is_not_seen_has_no_gradient():
    view = camera(48, 32)
    scene = [torch.cat([a, b]) for a, b in zip(cloud(20, view), one(view), strict=True)]
    scene[0][:10, 2] *= -1
    scene[3][-1] = 0
    for name, gradient in gradients(scene, view, "numba", torch.float32).items():
        assert torch.isfinite(gradient).all(), name
        assert not gradient[:10].any(), name
        assert not gradient[-1].any(), name


GPU = pytest.mark.skipif(bool(lacking()), reason=f"gsplat needs {lacking()}")


@pytest.mark.parametrize(("engine", "device"), [("numba", "cpu"), pytest.param("gsplat", "cuda", marks=GPU)])
def test_no_gaussians_at_all_have_gradients_of_no_length(engine, device):
    view = camera(48, 32)
    found = gradients([t[:0] for t in cloud(5, view)], view, engine, torch.float32, device=device)
    assert found["mean"].shape == (0, 3)


def test_the_probe_says_how_a_shift_of_the_centre_in_pixels_changes_the_loss():
    view = camera(48, 32)
    scene = one(view)
    found = gradients(scene, view, "numba", torch.float32, ("alpha",))
    expected = found["mean"][0, :2] * scene[0][0, 2] / torch.tensor([view.fx, view.fy])
    # Moving a round Gaussian across the view also turns its ellipse a little.
    assert torch.allclose(found["probe"][0], expected, rtol=0.05, atol=1e-3)


@GPU
def test_the_cuda_engine_agrees_with_the_twin():
    view = camera(61, 47)
    scene = cloud(200, view, seed=2)
    scene[3] = scene[3] * 0.9
    fast = gradients(scene, view, "gsplat", torch.float32, device="cuda")
    slow = gradients(scene, view, "twin", torch.float64)
    for name in fast:
        assert distance(fast[name], slow[name]) < TOLERANCE["cuda"], name


@pytest.mark.parametrize(("engine", "device"), [("numba", "cpu"), pytest.param("gsplat", "cuda", marks=GPU)])
def test_several_sets_at_once_are_drawn_as_one_by_one(engine, device):
    view = camera(48, 32)
    clouds = [[t.to(device, torch.float32) for t in cloud(60, view, seed=seed)] for seed in (3, 4, 5)]

    def drawn(scene):
        """Picture, and the gradients of all that goes in."""
        scene = [t.clone().requires_grad_() for t in scene]
        probe = torch.zeros(*scene[0].shape[:-1], 2, device=device, requires_grad=True)
        seen = rasterise(*scene, view, background=BACK, engine=engine, probe=probe)
        parts = seen.rgb, seen.depth, seen.alpha, seen.weight
        pictures = [seen] if scene[0].ndim == 2 else [Image(*each) for each in zip(*parts, strict=True)]
        sum(map(loss, pictures)).backward()
        return [t.detach() for t in parts], [t.grad for t in (*scene, probe)]

    together = drawn([torch.stack(each) for each in zip(*clouds, strict=True)])
    alone = [drawn(each) for each in clouds]
    # A GPU adds in another order each time.
    for kind, most in ((0, {"cpu": 1e-7, "cuda": 1e-5}), (1, {"cpu": 1e-6, "cuda": TOLERANCE["cuda"]})):
        for several, each in zip(together[kind], zip(*(single[kind] for single in alone), strict=True), strict=True):
            assert distance(several, torch.stack(each)) < most[device]
