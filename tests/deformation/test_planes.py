import numba
import numpy as np
import pytest
import torch
from scipy.interpolate import BSpline, interp1d

from surgisim.deformation.lookup import shares
from surgisim.deformation.planes import SPACE, Layout, features
from surgisim.deformation.sheets import Sheets
from surgisim.deformation.smoothness import roughness

SIZES = np.array([[4, 5, 3, 4], [7, 6, 4, 9]])


@pytest.fixture(params=[False, True], ids=["straight", "cubic"])
def planes(request):
    layout = Layout(SIZES, 10, request.param)
    rng = np.random.default_rng(0)
    return layout, torch.tensor(rng.uniform(0.5, 1.5, layout.count)), torch.tensor(rng.uniform(0.02, 0.98, (40, 3)))


def spline(time, n, cubic):
    """Shares of n knots at `time`, by scipy: in straight lines, or by its B-spline over knots that go on straight
    beyond both ends."""
    if not cubic:
        return interp1d(np.arange(n), np.eye(n), axis=0)(time * (n - 1))
    beyond = np.zeros((n + 2, n))
    beyond[1:-1] = np.eye(n)
    beyond[0], beyond[-1] = 2 * beyond[1] - beyond[2], 2 * beyond[-2] - beyond[-3]
    return BSpline(np.arange(-3, n + 3), beyond, 3)(time * (n - 1))


def twin(flat, where, time, layout):
    """The same through torch's own bilinear lookup, and scipy's splines in time."""
    out = []
    for scale in range(len(layout.sizes)):

        def look(index, down, across, scale=scale):
            grid = torch.stack([across, down], 1)[None, None] * 2 - 1
            plane = layout.plane(flat, scale, index)
            if index >= 3:
                share = torch.tensor(spline(float(down[0]), len(plane), layout.cubic))
                plane = torch.einsum("t,tnc->nc", share, plane)[None]
            kept = {"mode": "bilinear", "padding_mode": "border", "align_corners": True}
            return torch.nn.functional.grid_sample(plane.permute(2, 0, 1)[None], grid, **kept)[0, :, 0].T

        space = torch.stack([look(p, where[:, i], where[:, j]) for p, (i, j) in enumerate(SPACE)]).prod(0)
        now, rest = (
            torch.stack([look(3 + a, torch.full_like(where[:, 0], t), where[:, a]) for a in range(3)]).prod(0)
            for t in (time, 0.0)
        )
        out.append(space * (now - rest))
    return torch.cat(out, 1)


@pytest.mark.parametrize("time", [0.0, 0.37, 1.0])
def test_features_and_their_slopes_agree_with_torch(planes, time):
    layout, flat, where = planes
    slope = torch.tensor(np.random.default_rng(1).standard_normal((40, layout.features)))
    results = []
    for look in (features, twin):
        a, b = flat.clone().requires_grad_(), where.clone().requires_grad_()
        value = look(a, b, time, layout)
        (value * slope).sum().backward()
        results.append((value.detach(), a.grad, b.grad))
    for mine, other in zip(*results, strict=True):
        torch.testing.assert_close(mine, other, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("cubic", [False, True])
@pytest.mark.parametrize("n", [2, 3, 4, 9])
def test_knots_in_time_are_read_smoothly_and_ends_and_straight_lines_as_they_are(n, cubic):
    wanted = np.linspace(0, 1, 41)
    found = np.stack([shares(time, n, cubic) for time in wanted])
    np.testing.assert_allclose(found, [spline(time, n, cubic) for time in wanted], atol=1e-12)
    np.testing.assert_array_equal(found[[0, -1]], np.eye(n)[[0, -1]])
    np.testing.assert_allclose(found @ np.linspace(0, 1, n), wanted, atol=1e-12)


def test_slopes_agree_with_differences(planes):
    layout, flat, where = planes
    few = Layout(layout.sizes[:1], 2, layout.cubic)
    flat, where = flat[: few.count].clone().requires_grad_(), where[:4].clone().requires_grad_()
    assert torch.autograd.gradcheck(lambda a, b: features(a, b, 0.37, few), (flat, where))


def test_nothing_has_moved_at_the_start(planes):
    layout, flat, where = planes
    assert not features(flat, where, 0.0, layout).any()


def test_outside_the_box_the_border_is_read(planes):
    layout, flat, where = planes
    outside = where.clone()
    outside[:, 0] = 1.7
    border = where.clone()
    border[:, 0] = 1.0
    assert torch.equal(features(flat, outside, 0.4, layout), features(flat, border, 0.4, layout))


def test_the_number_of_threads_changes_no_byte(planes):
    layout, flat, where = planes
    flat, where = flat.float(), where.float()
    grads = []
    before = numba.get_num_threads()
    for threads in {1, before}:
        numba.set_num_threads(threads)
        a, b = flat.clone().requires_grad_(), where.clone().requires_grad_()
        features(a, b, 0.4, layout).square().sum().backward()
        grads.append((a.grad.numpy().tobytes(), b.grad.numpy().tobytes()))
    numba.set_num_threads(before)
    assert len(set(grads)) == 1


def test_sheets_hold_the_planes_and_are_read_and_smoothed_as_they_are(planes):
    layout, flat, where = planes
    where = torch.cat([where, where * 3 - 1])
    sheets = Sheets(layout, flat)
    torch.testing.assert_close(sheets.unpack(sheets.pack(flat)), flat, rtol=0, atol=0)
    for times in ([0.0], [0.37], [1.0], [0.2, 0.0, 0.9]):
        slope = torch.tensor(np.random.default_rng(1).standard_normal((len(times), 80, layout.features)))
        a, b = flat.clone().requires_grad_(), where.clone().requires_grad_()
        value = torch.stack([features(a, b, time, layout) for time in times])
        space, later = roughness(a, layout)
        ((value * slope).sum() + 2 * space + 3 * later).backward()
        c, d = sheets.pack(flat).requires_grad_(), where.clone().requires_grad_()
        mine, (space, later) = sheets.features(c, d, times), sheets.roughness(c)
        ((mine * slope).sum() + 2 * space + 3 * later).backward()
        for found, wanted in ((mine, value), (sheets.unpack(c.grad), a.grad), (d.grad, b.grad)):
            torch.testing.assert_close(found, wanted, rtol=1e-10, atol=1e-12)
