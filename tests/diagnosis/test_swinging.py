"""Bodies that swing or hang: the engine answers, and the law that was left out is the one that foretells best."""

from dataclasses import replace

import numpy as np
import pytest
from planted import TRUE, block, recording

from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis.clip import clip_of
from surgisim.diagnosis.prior import START
from surgisim.diagnosis.swinging import course, fit
from surgisim.diagnosis.swinging import diagnose as made
from surgisim.diagnosis.swinging.diagnose import diagnose_swinging
from surgisim.diagnosis.swinging.fit import Tried
from surgisim.diagnosis.swinging.period import LONG, loading, responses, slowest_period
from surgisim.mpm.simulator import Breakdown
from surgisim.physics.place import Place
from surgisim.problem import Problem
from surgisim.recordings.mesh import Mesh
from surgisim.recordings.recording import Recording, no_grips

E, FRAMES, FIT = 2e4, 90, 60
SWING, TURNS = 20, 0.01
"""Frames of a swing, and how far it goes [m]."""


def released(points: np.ndarray, fps: float, mesh: Mesh | None = None, name: str = "let go") -> Recording:
    """A block, held below, that is let go while its weight lies along x; points [m], (K, T, 3)."""
    mesh, frames = mesh or block(), points.shape[1]
    low = mesh.vertices.min(0)
    held = np.array([[low - 1.0, [1.0, 1.0, low[2] + 0.0025]]])
    return Recording(
        name=name, fps=fps, mesh=mesh, boxes=held, points=points.astype(np.float32),
        visible=np.isfinite(points).all(-1), sigma=np.full(len(points), 1e-5), motion=no_grips(frames),
        density=1050.0, gravity=(9.81, 0.0, 0.0), starts="released", place=points[:, 0].astype(float),
        split={"fit": (0, FIT), "held_out": (FIT, frames)},
    )  # fmt: skip


def top(frames: int) -> np.ndarray:
    side = np.stack(np.meshgrid(np.linspace(-0.015, 0.015, 4), np.linspace(-0.012, 0.012, 3)), -1).reshape(-1, 2)
    return np.repeat(np.concatenate([side, np.full((12, 1), 0.012)], 1)[:, None], frames, 1)


FPS = 100.0


def swung(values, frames: int) -> np.ndarray:
    """How the top goes along x [m], (frames,): its pitch by the modulus, its decay by viscosity, its rest by a mass."""
    modulus = values["neo_hookean_ciarlet"]["E"]
    decay = 2.0 * values.get("newtonian", {}).get("eta", 0.0) / 10.0
    load = 1 + 20 * values.get("added_mass", {}).get("mass", 0.0)
    # A mass in one place pulls with all its weight, and takes part in the swing with half of it.
    t, turn = np.arange(frames) / FPS, 2 * np.pi * FPS / SWING * np.sqrt(modulus / E / (0.5 + 0.5 * load))
    return TURNS * load * E / modulus * (1 - np.exp(-decay * t) * np.cos(turn * t))


def take(values, seed: int, name: str = "take") -> Recording:
    rng, points = np.random.default_rng(seed), top(FRAMES)
    points = points + swung(values, FRAMES)[None, :, None] * np.array([1.0, 0, 0])
    return replace(released(points + 1e-5 * rng.standard_normal(points.shape), FPS, name=name), place=top(1)[:, 0])


@pytest.fixture
def engine(monkeypatch):
    """In place of the engine: the same motion from the laws' numbers; all but viscosity and a mass do nothing."""

    def simulate(clip, values, places, frames, memo=None):
        if values["neo_hookean_ciarlet"]["E"] < 4e3:
            raise Breakdown("torn apart")
        return np.repeat(swung(values, frames)[None, :, None] * np.array([1.0, 0, 0]), len(clip.kept), 0)

    for room in (fit, made):
        monkeypatch.setattr(room, "simulate", simulate)
    monkeypatch.setattr(made, "slowest_period", lambda clip, x: SWING / FPS * np.sqrt(E / np.exp(x[0])))


def found(recordings, held_out=None, **settings):
    return diagnose_swinging(recordings, held_out, Diagnosing(grid=0.23, **settings), lambda *_: None)


def base(**laws):
    return {"neo_hookean_ciarlet": {"E": E, "nu": 0.45}, **laws}


def test_a_cantilevers_slowest_period_is_that_of_its_closed_form():
    mesh = block()
    length, width = 0.08, 0.012
    corner = (mesh.vertices - mesh.vertices.min(0)) / np.ptp(mesh.vertices, axis=0) * [width, width, length + 0.0025]
    points = np.repeat(np.array([[[0.006, 0.006, z]] for z in (0.02, 0.04, 0.06, 0.08)]), FRAMES, 1)
    clip = clip_of(released(points, 100.0, Mesh(corner, mesh.faces)), share=0.14)
    x = START.copy()
    x[0] = np.log(5e4)
    frequency = 1.8751**2 / (2 * np.pi) * np.sqrt(5e4 * width**2 / 12 / 1050.0 / length**4)
    assert slowest_period(clip, x) == pytest.approx(1 / frequency, rel=0.08)
    # A stiffer one is quicker by the root.
    x[0] += np.log(4.0)
    assert slowest_period(clip, x) == pytest.approx(0.5 / frequency, rel=0.08)


def test_weight_sets_in_at_once_and_a_pull_as_fast_as_it_goes():
    clip = clip_of(released(top(FRAMES), 100.0), share=0.23)
    assert loading(clip) == pytest.approx(0.01)
    assert responses(clip, START).by_engine
    pulled = clip_of(recording(), share=0.23)
    assert 0.15 < loading(pulled) < 0.4
    told = responses(pulled, TRUE)
    assert told.ratio < LONG
    assert told.told()["used"] == "tangent"
    # As soft as this it is still swinging when the pull has arrived; what grips it, the tangent weighs all laws of.
    soft = TRUE - np.log(400.0) * np.eye(3)[0]
    told = responses(pulled, soft)
    assert told.ratio > LONG
    assert told.told()["used"] == "tangent"
    assert loading(clip_of(replace(pulled.recording, motion=no_grips(32)), share=0.23)) == np.inf


def test_a_body_that_never_rests_is_told_what_brings_it_to_rest(engine):
    true = base(newtonian={"eta": 3.0})
    verdict, physics, mismatch = found([take(true, 1)], take(true, 2, "other"), base="elastic")
    assert [e["term"] for e in verdict.effects] == ["newtonian"]
    assert physics.terms["newtonian"]["eta"]["value"] == pytest.approx(3.0, rel=0.02)
    assert physics.terms["neo_hookean_ciarlet"]["E"]["value"] == pytest.approx(E, rel=0.01)
    # What another recording of it may begin with is the base without that.
    assert physics.alone == verdict.base
    assert physics.alone["E"]["low"] < E < physics.alone["E"]["high"]
    assert verdict.held_out["after"] < 0.05 * verdict.held_out["before"]
    assert "recording other, which was never fitted" in verdict.words
    assert verdict.global_test["responses"]["used"] == "engine"
    assert mismatch.residual_before.shape == (len(mismatch.points), FRAMES, 3)


def test_with_a_viscous_base_the_same_body_lacks_nothing(engine):
    true = base(newtonian={"eta": 3.0})
    verdict, _, _ = found([take(true, 1)], take(true, 2))
    assert verdict.base["eta"]["value"] == pytest.approx(3.0, rel=0.02)
    assert verdict.base["E"]["low"] <= E * 1.01
    assert verdict.held_out["before"] < 0.05
    assert verdict.verdict == "nothing detectable"


@pytest.mark.parametrize(("better", "said"), [(0.0, False), (0.1, True)])
def test_a_law_must_foretell_better_than_one_of_many_would_by_accident(engine, better, said):
    noise = np.random.default_rng(4).standard_normal((3, 12, FRAMES, 3))
    clip = clip_of(released(top(FRAMES) + 1e-4 * noise[0], FPS), share=0.23)
    held = replace(course.kept_out(clip), period=0.02)
    moved = {"base": 1e-5 * noise[1], "law": 1e-5 * noise[2] + better * clip.moved}

    class Runs:
        def moved(self, course, values, places):
            return moved[values]

    base, law = (Tried(None, START, np.zeros(0), n, {}, 0.0, 0.0, np.zeros(0)) for n in ("base", "law"))
    assert made.surely_better([(Runs(), base, law, held)], 9) == said
    assert made.surely_better([(Runs(), base, law, replace(held, period=np.inf))], 9) == said
    # Of itself nobody can be better.
    assert not made.surely_better([(Runs(), base, base, held)], 9)


def test_a_load_beside_a_base_that_another_recording_told_is_found_with_its_mass(engine):
    true = base(newtonian={"eta": 3.0}, added_mass={"mass": 0.03})
    told = {"E": (0.9 * E, 1.1 * E), "eta / E": (1.2e-4, 1.8e-4)}
    verdict, physics, _ = found([replace(take(true, 1), expected=told)], take(true, 2))
    assert verdict.effects[0]["term"] == "added_mass"
    assert physics.terms["added_mass"]["mass"]["value"] == pytest.approx(0.03, rel=0.1)


def test_a_page_shows_what_is_left_from_the_moment_of_release_on(engine):
    true = base(newtonian={"eta": 3.0})
    late = take(true, 1)
    points = late.points.copy()
    points[:, 2:] = late.points[:, :-2]
    points[:, :2] = late.points[:, :1]
    _, _, mismatch = found([replace(late, points=points)], take(true, 2))
    assert np.sqrt(np.nanmean(mismatch.residual_before**2)) < 1e-4


def test_viscosity_that_was_told_at_another_pitch_may_be_another(engine):
    """Silicone loses about as much in every swing: a slower one has more viscosity than the bare body's."""
    true = base(newtonian={"eta": 4.5}, added_mass={"mass": 0.03})
    told = {"E": (0.98 * E, 1.02 * E), "eta / E": (1.45e-4, 1.55e-4)}
    verdict, physics, _ = found([replace(take(true, 1), expected=told)], take(true, 2))
    assert verdict.effects[0]["term"] == "added_mass"
    assert physics.terms["added_mass"]["mass"]["value"] == pytest.approx(0.03, rel=0.05)
    assert physics.terms["newtonian"]["eta"]["value"] == pytest.approx(4.5, rel=0.1)


@pytest.mark.parametrize("late", [0.0, 2.4])
def test_a_hand_that_lets_go_a_little_later_is_no_part_of_any_law(late):
    moved, frames = swung(base(newtonian={"eta": 3.0}), FRAMES), np.arange(FRAMES)
    held = np.interp(frames - late, frames, moved, left=0.0)
    clip = clip_of(released(top(FRAMES) + held[:, None] * np.array([1.0, 0, 0]), FPS), share=0.23)
    simulated = np.repeat(moved[None, :, None] * np.array([1.0, 0, 0]), len(clip.kept), 0)
    left = course.whole(clip).left(simulated)
    assert np.sqrt((left**2).sum(1).mean()) < 0.01 * TURNS
    # Later than a hand takes is another matter.
    never = course.whole(clip).let_go(np.roll(simulated, 15, axis=1))
    assert np.abs(never - simulated).max() > 0.5 * TURNS


def test_two_recordings_are_fitted_together_and_a_third_is_foretold(engine):
    true = base(newtonian={"eta": 3.0})
    verdict, _, _ = found([take(true, 1), take(true, 2)], take(true, 3, "third"), base="elastic")
    assert verdict.effects[0]["term"] == "newtonian"
    assert "third" in verdict.words
    with pytest.raises(Problem, match="Say which one with --hold-out"):
        found([take(true, 1), take(true, 2)], base="elastic")


def test_recordings_of_different_bodies_are_refused(engine):
    mine, other = take(base(), 1), take(base(), 2, "other")
    wide = replace(other, boxes=other.boxes + 1e-3)
    with pytest.raises(Problem, match=r"their fixed\.json differ"):
        found([mine], wide)


def test_of_what_hangs_at_rest_every_second_point_is_held_out():
    points = top(FRAMES)
    points[:, 1 : FIT - 1] = np.nan
    clip = clip_of(replace(released(points, 100.0), place=top(1)[:, 0]), share=0.23)
    assert course.comes_to_rest(clip)
    half, rest = course.every_second(course.fitted(clip, 0.2))
    assert half.seen.sum() == rest.seen.sum() == 6 * 2
    assert not (half.seen & rest.seen).any()
    assert not course.comes_to_rest(clip_of(released(top(FRAMES), 100.0), share=0.23))


SAG, TALL = 3e-3, 0.06
"""Of the top of an even post of modulus E, and its height [m]."""


def sagged(values, places, height: np.ndarray) -> np.ndarray:
    """How far places of a post go along x [m], by the shear of what lies between them and what is held."""
    z = np.linspace(0.0025, TALL, 200)
    stiff = np.full(len(z), values["neo_hookean_ciarlet"]["E"] / E)
    if "stiff_inclusion" in values:
        share = places["stiff_inclusion"].weight(np.stack([0 * z, 0 * z, z], 1))
        stiff = stiff * (1 + (values["stiff_inclusion"]["s"] - 1) * share)
    return SAG * np.interp(height, z, np.cumsum((TALL - z) / stiff)) / np.cumsum(TALL - z)[-1]


def test_what_hangs_is_foretold_both_ways_and_its_soft_part_is_found(monkeypatch):
    def simulate(clip, values, places, frames, memo=None):
        moved = sagged(values, places, clip.rest[:, 2])[:, None, None] * np.array([1.0, 0, 0])
        return np.repeat(moved, frames, 1) * (np.arange(frames) > 0)[None, :, None]

    for room in (fit, made):
        monkeypatch.setattr(room, "simulate", simulate)
    monkeypatch.setattr(made, "slowest_period", lambda clip, x: SWING / FPS * np.sqrt(E / np.exp(x[0])))
    place = np.stack([np.zeros(14), np.zeros(14), np.linspace(0.006, 0.058, 14)], 1)
    true = Place((0.0, 0.0, 0.03), 0.001, (0.0, 0.0, -1.0))
    gone = sagged(
        {"neo_hookean_ciarlet": {"E": E}, "stiff_inclusion": {"s": 0.4}}, {"stiff_inclusion": true}, place[:, 2]
    )
    points = np.full((14, FRAMES, 3), np.nan)
    points[:, 0], points[:, FIT - 1] = place, place + gone[:, None] * np.array([1.0, 0, 0])
    points[:, FIT - 1] += 5e-5 * np.random.default_rng(5).standard_normal((14, 3))
    post = Mesh(block().vertices * [0.25, 0.25, 5.0], block().faces)
    hung = replace(released(points, FPS, post), place=place, split={"fit": (0, FIT), "held_out": (FIT, FIT)})
    ways = []
    swapped = made._swapped
    monkeypatch.setattr(made, "_swapped", lambda *told: ways.append(told) or swapped(*told))
    verdict, physics, _ = found([hung])
    assert len(ways) == 1
    assert verdict.effects[0]["term"] == "stiff_inclusion"
    assert "points between those that were fitted" in verdict.words
    assert "Without a softer part" in verdict.words
    assert physics.terms["stiff_inclusion"]["s"]["value"] == pytest.approx(0.4, rel=0.2)
    assert physics.places["stiff_inclusion"]["center"][2] == pytest.approx(0.03, abs=0.004)
