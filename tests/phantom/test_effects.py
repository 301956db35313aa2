"""Each concealed effect does what its name says, and nothing when it is silent."""

from dataclasses import replace

import numpy as np
import pytest
from concealed_pieces import PULL, SPACING, block, cube, drawn, sheared, stress, with_effect

from surgisim.phantom.effect import catalogue
from surgisim.phantom.follow import advance, follow, substeps
from surgisim.phantom.model import model

EFFECTS = catalogue()
every_effect = pytest.mark.parametrize("name", list(EFFECTS))
SCENE = block()
LAW = SCENE.law
FIRST = SCENE.holds[0]


@pytest.fixture(scope="module")
def plain():
    return follow(model(SCENE, SPACING))


@pytest.fixture(scope="module")
def moved():
    """Paths of the probes with an effect at the strength where its search begins, run once."""
    runs = {}

    def run(name, **changes):
        key = name, *sorted(changes.items())
        if key not in runs:
            runs[key] = follow(with_effect(drawn(name), **changes))
        return runs[key]

    return run


def near(hidden, reach=0.005):
    rest = SCENE.shape.upper(SCENE.probes)
    return np.linalg.norm((rest - hidden.center)[:, :2], axis=1) < reach


def stretched(before, after):
    """RMS change of the distances between points."""
    lengths = [np.linalg.norm(x[:, None] - x[None], axis=-1) for x in (before, after)]
    return np.sqrt(((lengths[1] - lengths[0]) ** 2).mean())


def frame(time):
    return round(time * SCENE.fps)


@every_effect
def test_a_silent_effect_changes_nothing(name, plain):
    short = follow(with_effect(drawn(name), 1e-9))
    assert np.abs(short - plain).max() < 1e-7


@every_effect
def test_an_effect_moves_what_can_be_seen(name, plain, moved):
    if not EFFECTS[name].faint:
        assert np.abs(moved(name) - plain).max() > 3e-5


def test_tilted_gravity_moves_tissue_its_way(plain, moved):
    hidden = drawn("gravity")
    push = ((moved("gravity") - plain) @ hidden.vector("direction")).mean(0)
    assert np.abs(push[: frame(hidden.onset)]).max(initial=0) < 1e-9
    assert push[-1] > 1e-5


def test_an_inclusion_deforms_less_than_it_would_without(plain):
    hidden = replace(drawn("stiff_inclusion"), center=np.array([0.004, 0.0, -0.003]), extent=0.006)
    stiff = follow(with_effect(hidden, 8.0))
    inside = near(hidden, 0.0045)
    spread = [stretched(run[inside, 0], run[inside, FIRST.release]) for run in (stiff, plain)]
    assert spread[0] < 0.8 * spread[1]


def test_a_tether_holds_back_only_when_its_slack_is_spent(plain):
    hidden = drawn("tether")
    hidden.numbers["slack"] = (0.5e-3, "m")
    held = follow(with_effect(hidden))
    gone = np.linalg.norm(plain - plain[:, :1], axis=-1)
    first = np.flatnonzero((gone > 0.5e-3)[near(hidden, 2 * hidden.extent)].any(0))[0]
    assert np.abs(held - plain)[:, : first - 1].max() < 2e-5
    patch = near(hidden)
    assert np.linalg.norm((held - held[:, :1])[patch, 25], axis=-1).mean() < 0.9 * gone[patch, 25].mean()


def test_fibres_resist_stretch_along_them_and_not_shortening():
    hidden = drawn("fibre")
    a = hidden.vector("direction")
    along, across = (np.outer(a, a), np.eye(3) - np.outer(a, a))
    pull = stress(cube(hidden), across + 1.2 * along)
    assert np.allclose(pull, 1.2 * (a @ pull @ a) / 1.2 * along, atol=1e-9)
    assert a @ pull @ a > 0
    assert not stress(cube(hidden), across + 0.8 * along).any()


def test_stiffening_grows_with_the_cube_of_shear():
    one, two = (stress(cube(drawn("stiffening")), sheared(s))[0, 1] for s in (0.05, 0.1))
    assert two / one == pytest.approx(8, rel=0.01)


def test_softening_takes_a_growing_share_of_the_stiffness_and_never_all():
    hidden = drawn("softening")
    shares = [-stress(cube(hidden), sheared(s))[0, 1] / (LAW.mu * s) for s in (0.1, 0.4, 3.0)]
    assert 0 < shares[0] < shares[1] < shares[2] < EFFECTS["softening"].start


def test_a_maxwell_branch_begins_at_its_share_and_fades_with_its_time():
    hidden = drawn("relaxation")
    tau, piece = hidden.number("tau"), cube(hidden)
    stress(piece, np.eye(3), dt=1e-6)
    begin = stress(piece, sheared(0.1), dt=1e-6)[0, 1]
    assert begin == pytest.approx(EFFECTS["relaxation"].start * LAW.mu * 0.1, rel=0.01)
    for _ in range(50):
        last = stress(piece, sheared(0.1), dt=tau / 50)[0, 1]
    assert last == pytest.approx(begin / np.e, rel=0.01)


def test_drainage_takes_its_share_of_the_bulk_stiffness_and_none_of_the_shear():
    hidden, swollen = drawn("drainage"), 1.02 * np.eye(3)
    piece = cube(hidden)
    assert np.abs(stress(piece, swollen, dt=0.0)).max() < 1e-9
    for _ in range(60):
        found = stress(piece, swollen, dt=0.1)
    J = 1.02**3
    assert found[0, 0] == pytest.approx(-EFFECTS["drainage"].start * LAW.lam * (J - 1) * J / 1.02, rel=0.01)
    assert abs(stress(cube(hidden), sheared(0.2), dt=9.0)[0, 1]) < 1e-9


def test_what_has_yielded_pushes_back_after_it_is_straightened():
    hidden = drawn("plastic_set")
    below = cube(hidden, 2.0)
    assert np.abs(stress(below, sheared(0.4))).max() < 1e-9
    beyond = cube(hidden, 2.0)
    stress(beyond, sheared(0.8))
    assert stress(beyond, np.eye(3))[0, 1] < -0.1 * LAW.mu
    # Shape changes without volume.
    assert np.isclose(np.linalg.det(beyond.forces[0].shape), 1).all()


def test_damage_softens_once_and_for_all():
    hidden = drawn("damage")
    piece = cube(hidden)
    stress(piece, sheared(0.5 * hidden.number("bears")))
    assert (piece.parts.mu == LAW.mu).all()
    stress(piece, sheared(0.8))
    worst = piece.parts.mu[0, 0]
    assert worst < 0.9 * LAW.mu
    stress(piece, np.eye(3))
    stress(piece, sheared(0.4))
    assert piece.parts.mu[0, 0] == worst


def test_a_slipping_tool_leaves_tissue_behind_after_the_onset():
    hidden = drawn("tool_slip")
    path, carried = with_effect(hidden).grasp[0], model(SCENE, SPACING).grasp[0]
    rest = np.zeros((1, 3))
    early, late = hidden.onset - 0.01, hidden.end
    assert np.allclose(path(early, rest), carried(early, rest))
    assert np.linalg.norm(path(late, rest)) < 0.95 * np.linalg.norm(carried(late, rest))


def test_a_twisting_tool_turns_about_its_own_middle():
    hidden = drawn("tool_twist")
    twist = with_effect(hidden).grasp[0]
    rest = hidden.center + np.array([[0, 0, 0], [0.004, 0, 0]])
    now = rest + twist(hidden.end, rest)
    assert np.allclose(now[0] - rest[0], PULL, atol=1e-9)
    assert np.linalg.norm(now[1] - now[0]) == pytest.approx(0.004)
    assert np.linalg.norm(now[1] - now[0] - (rest[1] - rest[0])) > 1e-3


def test_a_hidden_contact_comes_and_goes(plain, moved):
    hidden = drawn("hidden_contact")
    gap = np.abs(moved("hidden_contact") - plain).max((0, 2))
    inside = gap[frame(hidden.onset + 0.25) : frame(hidden.end - 0.2)].max()
    assert gap[: frame(hidden.onset)].max() < 1e-9
    assert inside > 1e-4
    assert gap[-1] < 0.05 * inside


def test_breathing_is_there_before_anything_is_touched(plain, moved):
    before = slice(0, FIRST.begin + 1)
    assert np.abs(moved("respiration", magnitude=2e-3) - plain)[:, before].max() > 5e-5
    assert np.abs(plain - plain[:, :1])[:, before].max() < 1e-12


def test_muscle_moves_while_the_tool_is_still(moved, plain):
    hidden = drawn("active_contraction")
    still = slice(FIRST.arrive + 6, FIRST.release)
    assert np.ptp(moved("active_contraction")[:, still], axis=1).max() > 5 * np.ptp(plain[:, still], axis=1).max()
    a, piece = hidden.vector("direction"), cube(hidden)
    pull = max(((stress(piece, np.eye(3), t=t) @ a) @ a for t in np.linspace(2, 4, 40)), key=abs)
    assert pull > 0


def test_tension_in_balance_is_silent_at_rest_and_stiffens_turning():
    piece, F = cube(drawn("pretension")), np.eye(3)
    assert np.abs(stress(piece, F)).max() < 1e-9
    a = drawn("pretension").vector("direction")
    lifted = F + 0.1 * np.outer([0, 0, 1], a)
    assert stress(piece, lifted)[2] @ a == pytest.approx(0.1 * EFFECTS["pretension"].start * LAW.E, rel=1e-6)


def test_a_sliding_base_moves_along_itself_only():
    made = with_effect(drawn("sliding_base"), 8.0)
    x, v, steps, taken = (
        made.mesh.points.copy(),
        np.zeros_like(made.mesh.points),
        substeps(made),
        {0: 0 * made.mesh.points},
    )
    for t in range(5, 16):
        advance(made, x, v, t, steps, taken)
    base = made.support.nodes
    gone = (x - made.mesh.points)[base]
    assert np.abs(gone[:, 2]).max() < 1e-12
    assert np.linalg.norm(gone, axis=1).max() > 1e-5
    assert np.linalg.norm(gone, axis=1).min() < 1e-6


def test_a_base_layer_differs_below_and_nowhere_else():
    hidden = drawn("base_layer")
    made, plain = with_effect(hidden), model(SCENE, SPACING)
    factor = (made.parts.mu / plain.parts.mu).reshape(-1)[: len(made.centers)]
    depth = 0.0125 + made.centers[:, 2]
    assert np.allclose(factor[depth > 1.2 * hidden.number("thickness")], 1)
    assert np.abs(np.log(factor[depth < 0.6 * hidden.number("thickness")])).min() > 0.5


def test_added_mass_weighs_what_it_says(plain, moved):
    hidden = drawn("added_mass")
    made, effect = with_effect(hidden), EFFECTS["added_mass"]
    mass = effect.value(SCENE, hidden.scaled(effect.start))
    assert made.burden[0].sum() == pytest.approx(mass)
    force = np.zeros_like(made.mesh.points)
    made.forces[0].add(None, None, hidden.onset + 1, 0.0, force)
    assert np.allclose(force.sum(0), [0, 0, -9.81 * mass])
    assert (moved("added_mass") - plain)[:, -1, 2].mean() < -1e-6


def test_a_damped_lump_is_more_viscous_inside_and_as_stiff():
    hidden = drawn("damping")
    made = with_effect(hidden)
    eta = made.parts.eta.reshape(-1)[: len(made.centers)]
    share = hidden.share(made.centers)
    assert np.allclose(eta, LAW.eta + EFFECTS["damping"].start * share)
    assert (made.parts.mu == LAW.mu).all()


def test_swelling_lifts_the_surface_above_it(plain, moved):
    hidden = drawn("swelling")
    lift = (moved("swelling") - plain)[:, -1, 2]
    assert lift[near(hidden)].mean() > 3e-5
    assert lift[near(hidden)].mean() > 2 * lift[~near(hidden, 0.012)].mean()


def test_a_cut_is_whole_before_it_opens():
    hidden = drawn("opening_cut")
    made = with_effect(hidden)
    least = []
    for t in (hidden.onset, hidden.onset + 0.16):
        made.forces[0].add(None, None, t, 0.0, None)
        least.append(made.parts.mu.min() / LAW.mu)
    assert least[0] == 1
    assert least[1] < 0.3


def test_a_second_grip_pulls_the_other_way(plain, moved):
    hidden = drawn("second_grip")
    at = frame((hidden.onset + hidden.end) / 2)
    moves = (moved("second_grip") - plain)[near(hidden, 0.004), at]
    assert (moves @ hidden.vector("direction")).mean() > 5e-4


PASSIVE = ("relaxation", "plastic_set", "damage", "damping", "drag", "sliding_base", "tether", "stiff_inclusion")


@pytest.mark.parametrize("name", PASSIVE)
def test_no_energy_comes_from_what_only_takes_it(name):
    made = with_effect(drawn(name), EFFECTS[name].start * 3 if name == "sliding_base" else None)
    x, v = made.mesh.points.copy(), np.zeros_like(made.mesh.points)
    v[:, 0] = 0.2 * (x[:, 2] - x[:, 2].min()) / 0.0125
    steps, mass = substeps(made), made.parts.mass[:, None]
    kinetic = [(mass * v * v).sum()]
    for _ in range(3):
        advance(made, x, v, 1, steps, {})
        kinetic.append((mass * v * v).sum())
    assert max(kinetic[1:]) < 1.001 * kinetic[0]


def test_drag_takes_more_than_viscosity_alone():
    left = []
    for made in (model(SCENE, SPACING), with_effect(drawn("drag"), 2e4)):
        x, v = made.mesh.points.copy(), np.zeros_like(made.mesh.points)
        v[:, 0] = 0.2 * (x[:, 2] - x[:, 2].min()) / 0.0125
        advance(made, x, v, 1, substeps(made), {})
        left.append(np.abs(v).max())
    assert left[1] < left[0]
