"""What the tangent answers is weighed by few fields and their courses as by its columns."""

import numpy as np
import pytest

from surgisim.diagnosis import benchmark
from surgisim.diagnosis.answers import Answers, each, side_by_side
from surgisim.diagnosis.device_whitener import DeviceWhitener
from surgisim.diagnosis.metric import metric
from surgisim.diagnosis.noise import Noise, whitener
from surgisim.diagnosis.sight import Sight
from surgisim.recordings.ways import turned

POINTS, FRAMES, STATES = 25, 30, 4
NUMPY_AND_TORCH = ("cpu", "cpu:0")


def noise(rng: np.random.Generator, turned: bool) -> Noise:
    ways = np.linalg.qr(rng.standard_normal((POINTS, 3, 3)))[0] if turned else None
    axes = rng.uniform(0.5, 1.5, (POINTS, 3)) if turned else None
    level = rng.uniform(1e-4, 3e-4, POINTS)
    return Noise(level, 0.3, 0.01, 0.05, 0.05, 0.9, 0.5, 0.3, 0.95, 0.3, axes, ways)


def answers(rng: np.random.Generator) -> Answers:
    share = rng.dirichlet(np.ones(STATES), FRAMES)
    courses = rng.uniform(0, 1, (5, FRAMES))
    pushes = each(1e-3 * rng.standard_normal((3, STATES, POINTS, 3)), share, courses)
    waves = Answers(1e-3 * rng.standard_normal((2, STATES, POINTS, 3)), share, rng.standard_normal((3, 2, FRAMES)))
    return side_by_side([pushes, waves])


@pytest.mark.parametrize("device", NUMPY_AND_TORCH)
@pytest.mark.parametrize("unseen", [0.0, 0.15])
@pytest.mark.parametrize("turned", [False, True])
def test_products_of_fields_with_courses_are_those_of_their_columns(unseen, turned, device):
    rng = np.random.default_rng(3)
    seen = rng.uniform(size=(POINTS, FRAMES)) >= unseen
    whiten = whitener(noise(rng, turned), 0.02 * rng.standard_normal((POINTS, 3)), seen)
    nuisances = 3e-4 * rng.standard_normal((7, POINTS, FRAMES, 3))
    sight = Sight(whiten, metric(whiten(nuisances).T), seen, device)
    residuals = whiten(2e-4 * rng.standard_normal((4, POINTS, FRAMES, 3))).T.astype(np.float32)
    left, mixed = sight.of(residuals), answers(rng)
    # As many columns as make pairs of frames the cheaper way.
    pushes = each(mixed.states[:3], mixed.share, rng.uniform(0, 1, (14, FRAMES)))
    assert [tried.columns.shape for tried in (mixed, pushes)] == [(count, POINTS, FRAMES, 3) for count in (18, 42)]
    for tried in (mixed, pushes):
        many, white = sight.products(tried.columns, left), whiten(tried.columns).T
        for a, b in zip(sight.products(tried, left), many, strict=True):
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-7 * np.abs(b).max())
        for a, b in ((many.gram, white), (many.shadow, residuals)):
            np.testing.assert_allclose(a, sight.space.gram(white, b), rtol=0, atol=1e-5 * np.abs(a).max())


def test_columns_go_cause_by_cause_and_part_by_part():
    rng = np.random.default_rng(4)
    share, states = np.eye(STATES)[[0, 1, 2, 3, 3]], rng.standard_normal((2, STATES, 1, 3))
    courses = rng.standard_normal((3, 5))
    columns = each(states, share, courses).columns
    over_time = np.einsum("ts,qski->qkti", share, states)
    np.testing.assert_allclose(columns[3 * 1 + 2], over_time[1] * courses[2][None, :, None])
    both = side_by_side([each(states, share, courses), each(2 * states, share, courses[:1])])
    np.testing.assert_allclose(both.columns[6:], 2 * columns[[0, 3]])


@pytest.mark.parametrize("device", NUMPY_AND_TORCH)
@pytest.mark.parametrize("kind", [np.float32, float])
def test_a_device_whitens_as_numpy_does(kind, device):
    rng = np.random.default_rng(5)
    seen = rng.uniform(size=(POINTS, FRAMES)) >= 0.15
    whiten = whitener(noise(rng, True), 0.02 * rng.standard_normal((POINTS, 3)), seen)
    fields = (3e-4 * rng.standard_normal((2, 3, POINTS, FRAMES, 3))).astype(kind)
    there = DeviceWhitener(whiten, device, np.dtype(kind).name)
    found, wanted = there.of_fields(turned(fields, whiten.ways)), whiten(fields)
    assert found.dtype == wanted.dtype == kind
    np.testing.assert_allclose(found, wanted, atol=(2e-5 if kind is np.float32 else 1e-6) * np.abs(wanted).max())
    np.testing.assert_allclose(there.of_fields(turned(fields, whiten.ways)[0, 0]), found[0, 0], atol=1e-5)
    assert there.of_fields(fields[:0]).shape == whiten(fields[:0]).shape == (0, 3, fields[0, 0].size)


def test_the_benchmark_compares_the_same_products():
    found = benchmark.measured(points=20, frames=16, unseen=0.1, device="cpu")
    assert {name for name in found if name.endswith("_apart")} == {"push_apart", "wave_apart"}
    assert max(found["push_apart"], found["wave_apart"]) < 1e-6
    assert min(found.values()) > 0
