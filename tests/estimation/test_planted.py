"""Parameters are planted, forgotten and found again; and what a clip cannot tell is said."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from slab import pulled
from slab_clip import CAMERA, QUICK, TRUE, T, alone, clip, silent

from surgisim.config.estimation import Estimation
from surgisim.estimation.carrying import TOWARD, TOWARD_READ, carrying
from surgisim.estimation.fit import estimate
from surgisim.estimation.observation import PHASES, phases
from surgisim.estimation.rounds import windows
from surgisim.estimation.search import search
from surgisim.physics.place import Place
from surgisim.problem import Problem


@pytest.fixture(scope="module")
def plain():
    return estimate(*clip(), Estimation(**QUICK), silent)


@pytest.mark.slow(60)
def test_planted_parameters_are_found_from_a_pull_and_its_release(plain):
    _, physics, fit, *_ = plain
    E, nu = (physics.terms["corotated"][p]["value"] for p in ("E", "nu"))
    eta = physics.terms["newtonian"]["eta"]["value"]
    assert eta / E == pytest.approx(1.2 / 900.0, rel=0.2)
    assert pytest.approx(900.0, rel=0.2) == E
    # On four and a half cells: the interval below is what has to hold.
    assert nu == pytest.approx(0.38, abs=0.03)
    assert fit.held_out["fitted"] < 0.5 * fit.held_out["default"]
    # Two and a half cells through the tissue: what a finer grid changes is all that is open of Poisson's ratio.
    assert fit.identifiability["corotated.E"]["told"]
    assert fit.identifiability["corotated.nu"]["rests_on"].keys() == {"grid"}
    assert fit.identifiability["corotated.E"]["high"] < 2 * fit.identifiability["corotated.E"]["low"]
    for name, true in (("corotated.E", 900.0), ("corotated.nu", 0.38), ("newtonian.eta", 1.2), ("held.depth", 0.015)):
        assert fit.identifiability[name]["low"] < true < fit.identifiability[name]["high"], name
    edges = {h["about"]: h["share"] for h in fit.history if h["round"] == "otherwise" and "beyond" in h["about"]}
    assert max(edges.values()) < 0.5
    # A tenth of how fast the tissue's own viscosity damps its slowest swing, eta w^2 / (2 E).
    slowest = 2 * np.pi * np.sqrt(E / (2 * (1 + nu)) / 1050.0) / (4 * fit.identifiability["held.depth"]["value"])
    assert abs(fit.numerical_damping) < 0.1 * eta / E * slowest**2 / 2
    assert "damps free vibration" in fit.words


@pytest.mark.slow
def test_a_pull_without_a_release_cannot_tell_the_modulus(monkeypatch):
    alone(monkeypatch)
    slow = pulled(frames=T, hold=T)
    _, _, fit, *_ = estimate(*clip(motion=slow, noise=1e-4), Estimation(**QUICK), silent)
    release = fit.identifiability["corotated.E"]["phases"]["release"]
    assert release == 0
    assert not fit.identifiability["corotated.E"]["told"]
    assert "cannot tell" in fit.words


@pytest.mark.slow
def test_without_a_grip_nothing_is_fitted_and_the_fit_says_so():
    case = list(clip())
    motion = case[3]
    case[3] = type(motion)(
        np.zeros((0, 3)), np.zeros(0), np.zeros((0, T, 3)), np.zeros((0, T), bool), np.zeros(0), "none"
    )
    _, physics, fit, *_ = estimate(*case, Estimation(**QUICK), silent)
    assert physics.terms["corotated"]["E"]["value"] == pytest.approx(3000.0)
    assert "cannot be learned" in fit.words


def test_a_grip_that_never_moves_teaches_nothing():
    case = list(clip())
    case[3] = replace(case[3], position=np.repeat(case[3].position[:, :1], T, 1))
    assert "no motion to learn" in estimate(*case, Estimation(**QUICK), silent)[2].words


@pytest.mark.slow
def test_a_still_clip_is_called_still():
    case = list(clip())
    xy = np.repeat(case[2].xy[:, :1], T, 1)
    case[2] = replace(case[2], xy=xy)
    assert "Nothing moves in this clip" in estimate(*case, Estimation(**QUICK), silent)[2].words


@pytest.mark.slow(60)
def test_frames_held_out_are_never_looked_at(plain):
    blind = list(clip())
    xyz = blind[2].xyz.copy()
    xyz[:, blind[4].split > 0] += 0.01
    blind[2] = replace(blind[2], xyz=xyz)
    second = estimate(*blind, Estimation(**QUICK), silent)
    assert np.array_equal(plain[0].values, second[0].values)


@pytest.mark.slow
def test_a_stiff_half_is_found_by_the_refinement(monkeypatch):
    alone(monkeypatch)

    def stiff(rest):
        return np.where(rest[:, 0] > 0, 2.0, 0.7)

    settings = Estimation(**{**QUICK, "field_iterations": 15, "smoothness": 0.3, "field": ["corotated.E"]})
    material, _, fit, _, laid, _ = estimate(*clip(stiff=stiff, noise=1e-5), settings, silent)
    right = laid.rest[:, 0] > 0
    E = material.values[:, 0]
    assert fit.held_out["field_kept"]
    assert E[right].mean() > 1.15 * E[~right].mean()


@pytest.mark.slow
def test_a_lump_whose_place_is_given_tells_how_stiff_it_is():
    places = {"stiff_inclusion": Place((0.009, 0.0, 0.066), 0.006)}
    known = TRUE | {"stiff_inclusion": {"s": 1.2}}
    fixed = ["corotated.E", "corotated.nu", "newtonian.eta"]
    given = {law: {"center": place.center, "extent": place.extent} for law, place in places.items()}
    settings = Estimation(**QUICK, terms=list(known), start=known, fixed=fixed, places=given, support=False)
    planted = clip(TRUE | {"stiff_inclusion": {"s": 3.0}}, noise=1e-5, places=places, spacing=0.006)
    _, physics, *_ = estimate(*planted, settings, silent)
    assert physics.terms["stiff_inclusion"]["s"]["value"] == pytest.approx(3.0, rel=0.1)
    assert physics.places["stiff_inclusion"]["extent"] == 0.006


@pytest.mark.slow
def test_a_place_for_a_law_that_the_body_lacks_is_refused():
    settings = Estimation(**QUICK, places={"tether": {"center": (0.0, 0.0, 0.06), "extent": 0.01}})
    with pytest.raises(Problem, match=r"estimation\.places' names 'tether'"):
        estimate(*clip(), settings, silent)


@pytest.mark.slow(35)
def test_a_path_that_would_turn_the_tissue_inside_out_lets_it_slip_and_says_so():
    case = list(clip())
    wild = pulled(frames=T, hold=9, by=(0.0, 0.0, 0.03))
    case[3] = replace(wild, center_rest=case[3].center_rest)
    _, physics, fit, *_ = estimate(*case, Estimation(**{**QUICK, "iterations": 1, "support": False}), silent)
    assert physics.grip < 1
    assert fit.held_out["grip"] == physics.grip
    assert "slips" in fit.words


def test_rounds_double_so_that_their_sum_stays_below_twice_the_clip():
    for frames in (24, 100, 400):
        ends = windows(np.arange(1, frames), phases(pulled(frames=frames, hold=9), frames), 0.1)
        assert ends[-1] == frames - 1
        assert sum(ends) <= 2 * frames
        assert all(b > a for a, b in itertools.pairwise(ends))
        assert ends[0] >= 14


@pytest.mark.slow(35)
def test_how_deep_the_body_is_held_is_found_from_the_spread_of_the_pull():
    _, _, fit, _, laid, doubts = estimate(*clip(deep=0.009), Estimation(**QUICK), silent)
    depth = fit.identifiability["held.depth"]
    assert depth["value"] == pytest.approx(0.009, abs=0.002)
    assert fit.held_out["support"]["depth"] == depth["value"]
    assert laid.rest[~laid.held, 2].max() < 0.06 + depth["value"]
    # Held a standard deviation deeper, tissue that is pulled goes elsewhere, and only then.
    deeper = doubts.moved[list(doubts.names).index("held.depth")]
    assert np.abs(deeper[:, 0]).max() < 1e-6
    assert np.abs(deeper[:, 8]).max() > 1e-5
    assert not {"corotated.E", "grip 0.release"} & set(doubts.names)


@pytest.mark.slow(45)
def test_how_far_the_grip_comes_nearer_is_found_where_depth_is_not_measured():
    case = list(clip(noise=2e-5))
    tracks, motion = case[2], case[3]
    flat = np.repeat(motion.position[:, :1, 2], T, 1)
    seen = CAMERA.lift(CAMERA.project(motion.position), flat)
    case[2] = replace(tracks, sigma_xyz=tracks.sigma_xyz + np.array([0.0, 0.01], np.float32))
    case[3] = replace(motion, position=seen)
    _, _, fit, carried, *_ = estimate(*case, Estimation(**QUICK), silent)
    nearer = fit.identifiability["grip 0.toward"]
    assert nearer["low"] < -0.006 < nearer["high"]
    assert nearer["value"] == pytest.approx(-0.006, rel=0.2)
    assert nearer["high"] < 0
    assert carried.position[0, 8, 2] - carried.position[0, 0, 2] == pytest.approx(nearer["value"], rel=0.05)


def test_what_a_found_path_says_of_coming_nearer_is_where_the_fit_begins():
    _, _, tracks, motion, *_, camera = clip(noise=2e-5)
    for share, spread in ((0.5, TOWARD_READ), (0.0, TOWARD)):
        position = motion.position.copy()
        position[..., 2] = 0.06 + share * (position[..., 2] - 0.06)
        open_, *_ = carrying(replace(motion, position=position), tracks, camera, measured=False).unknowns
        assert open_.name == "grip 0.toward"
        assert open_.size * open_.start == pytest.approx(share * -0.006, abs=3e-4)
        assert open_.spread == spread
        assert open_.before == TOWARD


def test_phases_follow_the_grip():
    phase = [PHASES[k] for k in phases(pulled(frames=16, hold=9), 16)]
    assert phase[2] == "load"
    assert phase[8] == "hold"
    assert phase[10:] == ["release"] * 6


@pytest.mark.parametrize(
    ("start", "fixed", "said"),
    [({"corotated": {"E": 1.0}}, [], "outside 100"), ({}, ["corotated.G"], "no parameter of the chosen laws")],
)
def test_a_start_that_does_not_exist_or_fit_is_refused(start, fixed, said):
    with pytest.raises(Problem, match=said):
        search(["corotated"], start, fixed)
