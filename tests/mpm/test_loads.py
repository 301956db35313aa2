"""Laws that enter elsewhere than the stress do in a run what their first line says."""

from dataclasses import replace

import numpy as np
import pytest
from tiny import BASE, BODY, DENSITY, FRAMES, MIDDLE, PULL, STEP, body, driven, on, under

from surgisim.artifacts.motion import Motion
from surgisim.mpm.setup import prepare
from surgisim.problem import Problem

LEFT_ALONE = Motion(
    np.zeros((0, 3)), np.zeros(0), np.zeros((0, FRAMES, 3)), np.zeros((0, FRAMES), bool), np.zeros(0), "none"
)
EVERY = 10
"""Steps between the states that are looked at."""


def moved(name, motion=PULL, made=None, points=(MIDDLE.center,), base=None, **numbers):
    """Displacement of points of the block over time [m], (T, Q, 3), and the time of each row [s]."""
    made = made or body(under(name))
    values = on(under(name)) | {"corotated": {**BASE["corotated"], **(base or {})}}
    values[name] = {**values[name], **numbers}
    drive = replace(driven(made, values, motion), per_frame=EVERY)
    run = made.simulator.run(made.theta(values), drive)
    carry = made.simulator.carry(np.array(points))
    return np.stack([carry @ u for u in run.u]), np.arange(len(run.u)) * EVERY * STEP


def path(by, active=None):
    """The grip's displacement at every frame [m], (T, 3), as a motion."""
    held = np.ones((1, FRAMES), bool) if active is None else active
    return replace(PULL, position=PULL.center_rest + np.asarray(by, float)[None], active=held)


def ramp(to, frames=5):
    return np.minimum(np.arange(FRAMES) / frames, 1)[:, None] * np.array(to)


def test_a_body_with_a_weight_on_it_sags_more_and_rings_slower():
    def ringing(mass):
        made = prepare(
            BODY, under("added_mass"), density=DENSITY, places={"added_mass": MIDDLE}, gravity=(0.0, 9.81, 0.0),
            precision="double",
        )  # fmt: skip
        y, time = moved("added_mass", LEFT_ALONE, made, mass=mass)
        return y[:, 0, 1].mean(), time[y[:, 0, 1].argmax()]

    (sag, swing), (heavy_sag, heavy_swing) = ringing(0.0), ringing(0.006)
    assert heavy_sag > 1.5 * sag > 0
    assert heavy_swing > 1.2 * swing


def test_gravity_as_a_law_is_gravity_of_the_world():
    made = prepare(BODY, under("newtonian"), density=DENSITY, gravity=(0.0, 9.81, -3.0), precision="double")
    world, _ = moved("newtonian", made=made)
    law, _ = moved("gravity", x=0.0, y=9.81, z=-3.0, onset=-1.0)
    assert np.allclose(law, world, rtol=0, atol=1e-9 * np.abs(world).max())


def test_a_tether_holds_back_only_what_leaves_it_and_only_beyond_its_slack():
    away, toward = path(ramp([0.0, 0.0, -0.003])), path(ramp([0.0, 0.0, 0.0015]))
    slack, taut, none = (
        moved("tether", away, slack=s, stiffness=k)[0][-1, 0, 2] for s, k in ((0.02, 100.0), (0.0, 100.0), (0.0, 0.0))
    )
    assert slack == none
    assert 0.3 * none > taut > none
    pushed, unheld = (moved("tether", toward, slack=0.0, stiffness=k)[0][-1] for k in (100.0, 0.0))
    assert np.array_equal(pushed, unheld)


def test_a_stiff_inclusion_deforms_less_than_the_same_place_without_it():
    made = prepare(
        BODY, under("stiff_inclusion"), density=DENSITY, places={"stiff_inclusion": MIDDLE}, gravity=(0.0, 0.0, -9.81),
        precision="double",
    )  # fmt: skip
    ends = np.array(MIDDLE.center) + np.array([[0.0, 0.0, -0.003], [0.0, 0.0, 0.003]])
    stiff, plain, soft = (
        np.ptp(moved("stiff_inclusion", LEFT_ALONE, made, points=ends, s=s)[0][-1], 0) for s in (8, 1, 0.2)
    )
    assert np.linalg.norm(stiff) < 0.7 * np.linalg.norm(plain) < np.linalg.norm(plain) < np.linalg.norm(soft)


def test_breathing_moves_the_whole_body_at_its_period():
    corners = BODY.rest[[0, -1]] * 0.9 + 0.1 * BODY.rest.mean(0)
    amplitude, period = 0.002, 0.2
    breath = {"amplitude": amplitude, "period": period, "second": 0.0, "phase": -np.pi / 2}
    u, time = moved("respiration", LEFT_ALONE, points=corners, base={"E": 20000.0}, **breath)
    wanted = amplitude * (1 - np.cos(2 * np.pi * time / period))
    assert np.abs(u[..., 2] - wanted[:, None]).max() < 0.15 * np.ptp(wanted)
    assert np.abs(u[..., :2]).max() < 0.15 * np.ptp(wanted)


def test_a_sliding_base_does_not_come_back_the_way_it_went():
    out_and_back = path(np.array([0, 1, 2, 3, 3, 2, 1, 0, 0, 0, 0])[:, None] * np.array([0.001, 0.0, 0.0]))
    at_base = BODY.rest[BODY.held].mean(0, keepdims=True)
    bound = moved("sliding_base", out_and_back, points=at_base, share=0.0)[0][:, 0, 0]
    loose = moved("sliding_base", out_and_back, points=at_base, share=1.0, cap=0.02)[0][:, 0, 0]
    going, coming = 200 // EVERY, 500 // EVERY
    assert loose[300 // EVERY] > 5 * bound[300 // EVERY]
    assert loose[coming] - loose[going] > 0.3 * loose[300 // EVERY]
    assert abs(bound[coming] - bound[going]) < 0.2 * bound[300 // EVERY]
    assert abs(bound[-1]) < 0.1 * abs(loose[-1])


def test_drag_slows_the_surface_after_a_snap_release():
    at_face = BODY.rest[BODY.surface].mean(0, keepdims=True)
    motion = path(ramp([0.002, 0.0, 0.0], 3), np.arange(FRAMES)[None] < 5)
    free, slowed = (moved("drag", motion, points=at_face, c=c)[0][:, 0, 0] for c in (0.01, 100.0))
    fastest = [np.abs(np.diff(x[410 // EVERY :])).max() for x in (free, slowed)]
    assert fastest[1] < 0.8 * fastest[0]


def test_a_hidden_contact_pushes_along_its_heading_from_onset_to_end():
    u, time = moved("hidden_contact", LEFT_ALONE, force=0.1, yaw=np.pi / 2, pitch=0.0, onset=0.1, end=0.2)
    before, during, after = np.abs(u[time < 0.04]).max(), u[(time > 0.15) & (time < 0.2), 0], np.abs(u[-1]).max()
    assert during[:, 0].mean() > 10 * np.abs(during[:, 1:]).mean()
    assert before < 1e-3 * during[:, 0].max()
    assert after < 0.1 * during[:, 0].max()


def test_a_slipping_tool_leaves_less_displacement_and_loses_more_on_every_pull():
    twice = path(np.array([0, 1, 2, 2, 0, 0, 1, 2, 2, 2, 2])[:, None] * np.array([0.0, 0.0, -0.001]))
    at_grip = PULL.center_rest + np.array([0.0, 0.0, 0.002])
    firm = moved("tool_slip", twice, points=at_grip, slip=0.0)[0][:, 0, 2]
    slipping = moved("tool_slip", twice, points=at_grip, slip=0.4, onset=0.0)[0][:, 0, 2]
    late = moved("tool_slip", twice, points=at_grip, slip=0.4, onset=0.16)[0][:, 0, 2]
    first, second = 300 // EVERY, -1
    assert slipping[first] / firm[first] == pytest.approx(0.6, abs=0.05)
    assert slipping[second] / firm[second] < 0.35
    assert late[first] == pytest.approx(firm[first], rel=1e-2)
    assert abs(late[second]) < 0.75 * abs(firm[second])


def test_a_pulsing_vessel_swells_and_shrinks_with_its_beat():
    ends = np.array(MIDDLE.center) + np.array([[-0.003, 0.0, 0.0], [0.003, 0.0, 0.0]])
    u, time = moved("pulse", LEFT_ALONE, points=ends, base={"nu": 0.2}, pressure=600.0, rate=5.0, phase=0.0)
    wider = u[:, 1, 0] - u[:, 0, 0]
    wave = np.sin(2 * np.pi * 5.0 * time)
    assert np.corrcoef(wider, wave)[0, 1] > 0.95


def test_a_law_for_held_tissue_says_when_nothing_is_held():
    made = body(under("sliding_base"))
    with pytest.raises(Problem, match="law 'sliding_base' finds no tissue to act on: the body has none that the base"):
        made.theta(on(under("sliding_base")), held=np.zeros(len(BODY.rest), bool))
