"""Another solver's equilibria, at the small size; the full table is in docs/verification.md."""

import pytest

from surgisim.verification import fenics


@pytest.fixture(scope="module")
def result(shared):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SURGISIM_DATA", str(shared / "data"))
        return fenics.measure(lambda done, total, text: None, quick=True)


@pytest.fixture(params=["beam", "cube"])
def row(request, result):
    return result[request.param]["rows"][0]


def test_their_elements_with_our_law_repeat_their_answer(row):
    assert row["repeated"] < 1e-6


def test_equilibrium_is_within_five_percent_of_the_largest_displacement(row):
    assert row["runs"][-1]["max"] < 0.05


def test_the_error_falls_with_the_grid_faster_than_its_square_root(row):
    assert row["slope"] > 0.5


def test_every_run_ends_at_rest(row):
    assert all(run["left"] < 1e-3 for run in row["runs"])


def test_the_published_beam_is_further_from_the_converged_one_than_ours(result):
    row = result["beam"]["rows"][0]
    assert row["file"]["max"] > 0.2 > 4 * row["runs"][-1]["max"]
