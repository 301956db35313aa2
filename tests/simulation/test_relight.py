"""A replay is lit as its recording is, and no more than that."""

from dataclasses import replace

import numpy as np
import pytest
from slab import pulled, slab

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.frames import BETWEEN, Frames
from surgisim.artifacts.masks import Masks
from surgisim.artifacts.scene import Scene
from surgisim.gaussians.engine_gsplat import lacking
from surgisim.gaussians.rim import beyond
from surgisim.lighting.highlights import without
from surgisim.lighting.response import Response
from surgisim.lighting.strength import Strength
from surgisim.mpm.carried import Carried
from surgisim.mpm.setup import SKIN, prepare
from surgisim.simulation.draw import Drawn
from surgisim.simulation.relight import Light, find_light

FRAMES = 14
CAMERA = Camera(64, 48, 80.0, 80.0, 31.5, 23.5, 25.0, FRAMES, "known", "given", "slab", [64, 48], [0, 0, 64, 48])
VALUES = {"corotated": {"E": 1500.0, "nu": 0.42}, "newtonian": {"eta": 2.0}}
FULL = Strength(1.0, 1.0, 0.01, np.zeros(FRAMES), 0.1)
FACING = np.tile([0.0, 0.0, -1.0], (48, 64, 1))
BODY = slab()
SPECK = np.zeros((48, 64), bool)
SPECK[22:26, 16:20] = True


def light(glint=SPECK, strength=FULL, lobe=300.0):
    tissue = np.full((48, 64, 3), 0.2)
    return Light(CAMERA, FACING, tissue, glint, strength, 0.05, lobe)


@pytest.fixture(scope="module")
def played():
    """The pulled slab: simulator, displacements of every frame, its scene, and what lies beyond the picture."""
    n = 6000
    rng = np.random.default_rng(0)
    mean = np.c_[rng.uniform(-0.023, 0.023, n), rng.uniform(-0.017, 0.017, n), np.full(n, 0.0601)]
    shade = 0.35 + 0.1 * np.sin(300 * mean[:, :1]) * np.cos(250 * mean[:, 1:2])
    color = np.concatenate([shade + 0.2, shade, shade], 1)
    turn = np.tile([1.0, 0, 0, 0], (n, 1))
    scene = Scene(
        *(np.asarray(a, np.float32) for a in (mean, np.full(n, 3.0), np.full((n, 3), np.log(5e-4)), turn, color))
    )
    made = prepare(BODY, tuple(VALUES), density=1050.0, carried=mean, grips=pulled(FRAMES), skin=SKIN)
    steps = made.per_frame(VALUES, 25.0)
    path = made.drive(pulled(FRAMES), VALUES, fps=25.0, per_frame=steps, frames=FRAMES, firm=False)
    run = made.simulator.run(made.theta(VALUES), path)
    return made.simulator, run.u, scene


def picture(played, lamp, u, device="cpu"):
    """What the pulled slab by itself looks like under a lamp or under none."""
    simulator, _, scene = played
    nothing = replace(scene, **{name: value[:0] for name, value in vars(scene).items()})
    return Drawn(scene, nothing, BODY, simulator, False, device).under(lamp)(u, CAMERA)


def recorded(played, lamp):
    """A recording of the pulled slab, its used frames and one held out."""
    split = np.zeros(FRAMES, np.uint8)
    split[1] = BETWEEN
    rgb = np.stack([picture(played, lamp, u) for u in played[1]])
    noise = np.random.default_rng(1).normal(0, 2.0, rgb.shape)
    tool = np.zeros(rgb.shape[:3], bool)
    masks = Masks(tool, rgb.max(-1) > 20, tool, np.ones(FRAMES, np.float32))
    return Frames(np.clip(rgb + noise, 0, 255).astype(np.uint8), split), masks


def found(played, lamp, draw=None):
    simulator, states, scene = played
    draw = draw or (lambda lamp, u: picture(played, lamp, u))
    under = lambda lamp: lambda u: draw(lamp, u)  # noqa: E731
    return find_light(scene, CAMERA, BODY.spacing, simulator, states, *recorded(played, lamp), under)


@pytest.mark.skipif(bool(lacking()), reason=f"gsplat needs {lacking()}")
def test_a_gpu_draws_what_the_cpu_draws(played):
    for u in (played[1][0], played[1][-1]):
        there, here = (picture(played, None, u, device).astype(float) for device in ("cuda", "cpu"))
        assert np.abs(there - here).mean() < 1.0


def test_a_lamp_that_was_there_is_found_and_one_that_was_not_is_left_out(played):
    lit, unlit = found(played, light(glint=SPECK & False)).strength, found(played, None).strength
    assert 0.7 < lit.value < 1.3
    assert unlit.value < 0.15


def answering():
    """A lamp under which tissue beside the middle gets darker the farther it is lifted."""
    weight = np.zeros((13, 17, 3))
    weight[..., 2] = np.linspace(0.0, 1.6, 17)
    span = np.stack([np.full((13, 17), -2.0), np.full((13, 17), 2.0)], -1)
    return replace(light(glint=SPECK & False), response=Response(4.0, 0.004, weight, span, (1.0, 1.0)))


def test_what_a_lamp_does_not_explain_is_learned_beside_it_and_makes_the_picture_better(played):
    pulled_out = played[1][6]
    wanted = picture(played, answering(), pulled_out).astype(float)
    lamp = found(played, answering())
    apart = [np.abs(picture(played, one, pulled_out) - wanted).mean() for one in (lamp, replace(lamp, response=None))]
    assert lamp.response is not None
    assert apart[0] < 0.4 * apart[1]


def test_what_makes_the_pictures_worse_is_left_out(played):
    """Tissue is not where its pictures are drawn: whatever its way shows there is another's."""

    def worse(one, u):
        return picture(played, answering(), u) * (0.2 if one.strength.value or one.response else 1.0)

    lamp = found(played, answering(), worse)
    assert lamp.strength.value == 0
    assert lamp.response is None


def test_without_motion_every_colour_stays():
    rest = CAMERA.lift(np.argwhere(np.ones((48, 64)))[:, ::-1].astype(float), np.full(64 * 48, 0.06))
    color = np.random.default_rng(2).uniform(0, 1, (len(rest), 3))
    still = light().shade(rest, color)(rest, np.tile(np.eye(3), (len(rest), 1, 1)))
    assert np.allclose(still, color, atol=1e-6)


def test_a_highlight_does_not_ride_on_tissue_that_turns_or_is_carried_aside():
    rest = CAMERA.lift(np.array([[17.0, 23.0], [40.0, 23.0]]), np.full(2, 0.06))
    shade = light().shade(rest, np.array([[1.0, 1.0, 1.0], [0.4, 0.2, 0.2]]))
    straight = np.tile(np.eye(3), (2, 1, 1))
    angle = np.radians(12)
    turn = np.tile([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]], (2, 1, 1))
    assert np.allclose(shade(rest, straight)[0], 1.0)
    assert shade(rest, turn)[0].max() < 0.6
    assert shade(rest + np.array([0.012, 0, 0]), straight)[0].max() < 0.6
    assert shade(0.8 * rest, straight)[0].min() > 1.0  # straight at the lamp it stays, and brightens
    assert light(lobe=0.0).shade(rest, np.ones((2, 3)))(rest, turn)[0].min() > 0.9


def test_strength_zero_leaves_shading_and_takes_the_highlight_along_the_lobe_only():
    weak = replace(FULL, value=0.0)
    rest = CAMERA.lift(np.array([[40.0, 23.0]]), np.array([0.06]))
    color = np.array([[0.4, 0.2, 0.2]])
    assert np.allclose(light(strength=weak).shade(rest, color)(0.7 * rest, np.eye(3)[None]), color)


def test_the_tissue_under_a_highlight_is_filled_from_around():
    picture = np.full((48, 64, 3), 0.3)
    picture[SPECK] = 1.0
    assert np.allclose(without(picture, SPECK), 0.3, atol=1e-3)


def test_what_lies_beyond_the_picture_is_lit_as_its_edge(played):
    _, _, scene = played
    more = beyond(scene, CAMERA)
    shade = light(glint=SPECK & False).shade(more.mean, more.color)
    assert np.isfinite(shade(more.mean * 0.9, np.tile(np.eye(3), (len(more.mean), 1, 1)))).all()


def test_what_is_gripped_is_drawn_where_the_simulation_has_it(played):
    simulator, states, _ = played
    near = BODY.rest[np.linalg.norm(BODY.rest - [0, 0, 0.06], axis=1) < 0.004].astype(float)
    drawn = Carried(near, simulator).at(states[8])[0]
    assert np.allclose(drawn, near + simulator.carry(near) @ states[8], atol=1e-9)
    nodes, weight, _ = simulator.stencil(near)
    without_bend = near + np.einsum("qk,qka->qa", weight, simulator.displaced(states[8])[nodes])
    assert np.abs(drawn - without_bend).max() > 1e-4
