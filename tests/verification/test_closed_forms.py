"""The engine against closed forms, at the small size; the full one is docs/verification.md."""

import importlib
from functools import cache

import pytest


@cache
def measured(name: str) -> dict:
    case = importlib.import_module(f"surgisim.verification.{name}")
    return case.measure(lambda done, total, text: None, quick=True)


def test_mass_and_momenta_are_kept_to_rounding():
    result = measured("conservation")
    for row in result["laws"]:
        # Three standard deviations of a walk of that many roundings.
        rounding = 3 * row["eps"] * result["steps"] ** 0.5
        assert row["mass"] < 4 * row["eps"]
        assert max(row["momentum"]) < rounding
        assert max(row["angular"]) < rounding


def test_a_body_falls_half_a_step_ahead_of_the_parabola_and_keeps_its_shape():
    result = measured("free_fall")
    assert result["order"] == pytest.approx(1, abs=0.02)
    for row in result["rows"]:
        fallen = max(abs(x) for x in row["middle"])
        assert max(row["off_shifted"], row["deforms"]) < 0.5 * row["eps"] * row["steps"] * fallen


def test_free_bars_ring_as_beam_theory_says_to_second_order_in_the_grid():
    result = measured("bar")
    assert result["slopes"]["axial, free, nu 0.45"] == pytest.approx(2, abs=0.3)
    assert result["slopes"]["bending, free, nu 0.45"] == pytest.approx(2, abs=0.3)
    # Second order from three cells to the default five brings bending below 1.5 %.
    assert all(abs(r["error"]) < 0.03 for r in result["rows"] if r["cells"] >= 3)


def test_a_clamp_gives_way_by_as_much_as_its_springs_say():
    rows = [r for r in measured("bar")["rows"] if r["of_the_clamp"]]
    assert all(r["error"] == pytest.approx(r["of_the_clamp"], rel=0.1) for r in rows)


def test_a_viscous_rod_decays_with_its_axial_viscosity():
    for row in measured("viscous_rod")["rows"]:
        assert row["error"] == pytest.approx(0, abs=0.01)


def test_energy_is_kept_without_viscosity_to_second_order_in_the_step_and_never_grows_with_it():
    for row in measured("energy")["laws"]:
        if row["dissipative"]:
            assert all(r["growth"] <= 1e-6 for r in row["runs"])
            assert row["runs"][-1]["lost"] > 0.1
        else:
            assert row["order"] == pytest.approx(2, abs=0.3)
            assert row["runs"][0]["growth"] < 1e-3


def test_the_step_is_of_first_order_and_of_second_with_its_half_step_accounted_for():
    orders = measured("order")["step"]["orders"]
    assert orders["plain"] == pytest.approx(1, abs=0.3)
    assert orders["shifted"] == pytest.approx(2, abs=0.2)


def test_the_grid_is_of_second_order():
    assert measured("order")["grid"]["order"] == pytest.approx(2, abs=0.4)


def test_a_vibration_without_viscosity_does_not_die():
    for row in measured("damping")["rows"]:
        assert abs(row["decay"]) < 0.1
        assert abs(row["energy_decay"]) < 0.1


def test_only_the_updated_form_damps_and_more_with_smaller_steps():
    decay = {(r["form"], r["refine"]): r["decay"] for r in measured("damping")["forms"]}
    assert max(abs(decay["total", n]) for n in (1, 4)) < 0.05
    assert 0.05 < decay["updated", 1] < decay["updated", 4] / 2


def test_parameters_fitted_at_one_step_size_predict_a_release_at_a_quarter_of_it():
    result = measured("release")
    assert result["off_quarter"] < result["bound"]
    assert result["off_predicted"] < result["bound"]
    assert all(result["fitted"][n] == pytest.approx(v, rel=0.05) for n, v in result["truth"].items())


def test_a_stretched_and_a_hanging_rod_follow_the_linear_solid():
    for row in measured("creep")["rows"]:
        assert row["relaxation"]["largest_error"] < 0.01
        assert row["creep"]["largest_error"] < 0.01
