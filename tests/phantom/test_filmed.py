"""Clips that conceal something: all phases in the picture, effects as in the level block, and a truth that fits."""

import json

import numpy as np
import pytest
from concealed_pieces import block as level

from surgisim.config.invent import InventClip
from surgisim.phantom import case, filmed
from surgisim.phantom.blind import borne
from surgisim.phantom.effect import catalogue
from surgisim.phantom.family import RATES_SHOWN, draw_shown, told_focal
from surgisim.phantom.follow import nodes
from surgisim.phantom.scene import Scene

SPACINGS = (5e-3, 6e-3)


@pytest.fixture(scope="module")
def soft():
    """The softest of a few drawn clips, which takes the fewest steps, and its scene."""
    picture = min((draw_shown(3, n, SPACINGS) for n in range(6)), key=lambda p: p.E)
    drawn = case.invent(picture)
    return picture, drawn, filmed.scene_of(picture, drawn)


def test_every_clip_shows_rest_load_hold_and_release_on_whole_frames():
    for n in range(8):
        picture = draw_shown(11, n, SPACINGS)
        line = case.invent(picture).timeline
        marks = np.array([line.pull, line.hold, line.release, line.end]) * picture.fps
        assert marks == pytest.approx(np.rint(marks))
        assert (np.diff([0, *marks]) >= 5).all()
        assert picture.fps in RATES_SHOWN
        assert picture.sides == "free"
    told = [told_focal(11, n) for n in range(30)]
    assert 5 < sum(focal is None for focal in told) < 25


def test_what_is_filmed_is_what_the_points_are_said_to_do(soft):
    picture, drawn, scene = soft
    few = Scene(**{**vars(scene), "frames": scene.holds[0].arrive + 3})
    (_, (fine, _), (plain, _)) = borne(few, SPACINGS, None, filmed.in_elements)
    last = [x.copy() for x in nodes(fine)][-1]
    held = fine.mesh.gripped[0] & ~fine.mesh.fixed
    assert last[held] - fine.mesh.points[held] == pytest.approx(np.tile(drawn.pull, (held.sum(), 1)), abs=1e-9)
    near = np.linalg.norm(scene.probes - drawn.grip.uv, axis=1).argmin()
    assert plain[near, -1] - plain[near, 0] == pytest.approx(drawn.pull, abs=0.2 * picture.pull)
    free = filmed.in_view(drawn, few, plain)
    assert not free[near].any()
    assert 0.3 < free.mean() < 0.9
    pixel = drawn.view.project(plain)[free]
    assert (pixel > 0).all()
    assert (pixel < [picture.width, picture.height]).all()


@pytest.mark.parametrize("name", ["opening_cut", "second_grip"])
def test_an_effect_turns_with_the_tissue(name):
    flat, turn = level(), np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]
    turn *= np.linalg.det(turn)
    shape = flat.shape
    tilted = type(shape)(**{**vars(shape), "axes": shape.axes @ turn.T, "center": turn @ shape.center})
    holds = tuple(type(h)(**{**vars(h), "pull": turn @ h.pull}) for h in flat.holds)
    scene = Scene(**{**vars(flat), "shape": tilted, "holds": holds})
    here, there = (catalogue()[name].draw(s, np.random.default_rng(4), name) for s in (flat, scene))
    assert there.center == pytest.approx(turn @ here.center)
    key = "along" if name == "opening_cut" else "direction"
    assert there.vector(key) == pytest.approx(turn @ here.vector(key))


def test_the_truth_names_its_camera_beside_an_mp4(monkeypatch, soft):
    picture, _, scene = soft
    monkeypatch.setattr(filmed, "draw_shown", lambda *_: picture.model_copy(update={"width": 64, "height": 48}))
    monkeypatch.setattr(filmed, "concealed", lambda *_: ())
    monkeypatch.setattr(filmed, "scene_of", lambda *_: Scene(**{**vars(scene), "frames": 4, "split": 3}))
    made = filmed.film_concealed(InventClip(seed=3, spacing=SPACINGS[0], spacing_coarse=SPACINGS[1]))
    told = json.loads(made.truth)
    assert told["recording"] == "video-3-0.main"
    assert (told["kind"], told["effects"]) == ("nothing", [])
    assert told["camera"]["focal"] == pytest.approx(picture.focal * 64)
    assert b"ftyp" in made.clip[:32]
