"""Families of invented recordings: bodies that are sound, solvers that obey physics, effects that act, nothing told."""

import dataclasses
import io
import json

import numpy as np
import pytest

from surgisim.config.invent import FAMILIES, Invent
from surgisim.phantom.families import bodies, stepping
from surgisim.phantom.families import seen as seeing_of
from surgisim.phantom.families.blind import concealed, invent, left_open, recording
from surgisim.phantom.families.hidden import KINDS, described
from surgisim.phantom.families.oracle import UNKNOWN, Oracle
from surgisim.phantom.families.solvers import solver
from surgisim.phantom.families.solvers.lattice import Lattice
from surgisim.phantom.families.solvers.springs import Springs
from surgisim.phantom.families.solvers.tetrahedra import Tetrahedra, shapes
from surgisim.phantom.families.world import Grip, Material, World, draw
from surgisim.proof.numbers import COMPARED
from surgisim.recordings.folder import read_recording

MODELS = {"tetrahedra": Tetrahedra, "springs": Springs, "lattice": Lattice}


def test_every_family_that_may_be_asked_for_has_a_solver():
    assert set(MODELS) == set(FAMILIES)
    for name in FAMILIES:
        assert set(solver(name).CONCEALS) <= set(KINDS)


def generators(seed: int):
    return lambda part: np.random.default_rng([seed, *part.encode()])


def block(material: Material | None = None, grips: tuple[Grip, ...] = (), frames: int = 9, fps: float = 20.0) -> World:
    """A slab on a plate with a few probes."""
    body = bodies.draw(np.random.default_rng(0), "slab", "plate", 0.5)
    probes = np.arange(0, len(body.upper), 7)
    weights = np.full((len(probes), 3), 1 / 3)
    material = material or Material(4e3, 0.45, 20.0, 1000.0)
    return World(body, material, grips, fps, frames, frames - 2, None, probes, weights)


def grip(world: World, **changed) -> Grip:
    k = world.body.upper[len(world.body.upper) // 2, 0]
    told = {
        "center": world.body.points[k], "radius": 0.006, "pull": 0.003 * world.body.out[k], "aside": np.zeros(3),
        "course": "straight", "handling": "carried", "begin": 1, "arrive": 4, "release": 6, "early": 0.0, "late": 0.0,
    }  # fmt: skip
    return Grip(**told | changed)


@pytest.mark.parametrize(("kind", "support"), [(k, s) for k, all_of in bodies.SUPPORTS.items() for s in all_of])
def test_a_body_is_closed_and_its_boxes_hold_what_is_held(kind, support):
    for seed in range(3):
        body = bodies.draw(np.random.default_rng(seed), kind, support, 0.35)
        assert body.volume.min() > 0
        a, b, c = np.moveaxis(body.points[body.skin], 1, 0)
        assert (np.cross(a, b) * c).sum() / 6 == pytest.approx(body.volume.sum(), rel=1e-9)
        edges = np.sort(np.concatenate([body.skin[:, [0, 1]], body.skin[:, [1, 2]], body.skin[:, [2, 0]]]), 1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
        inside = [((body.points >= b["min"]) & (body.points <= b["max"])).all(1) for b in body.boxes]
        assert (np.any(inside, 0) == body.held).all()
        assert body.held.any()
        assert not body.held[body.upper].all()


@pytest.mark.parametrize("name", MODELS)
def test_nothing_moves_or_pushes_at_rest_nor_after_a_turn(name):
    points = MODELS[name](block(), {})
    still = np.zeros_like(points.rest)
    scale = 4e3 * 0.01**2
    assert np.abs(points.push(points.rest, still, 0.0, 0.01, False)).max() < 1e-9 * scale
    turn = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    assert np.abs(points.push(points.rest @ turn.T + 0.02, still, 0.0, 0.01, False)).max() < 1e-9 * scale


@pytest.mark.parametrize("name", MODELS)
def test_forces_balance_and_turn_nothing(name):
    """Third law: sums of forces and of torques are nothing, whatever the tissue remembers."""
    world = block()
    hidden = {n: KINDS[n].draw(world_with_grip(), np.random.default_rng(2), n) for n in solver(name).CONCEALS}
    inner = ("stiff_inclusion", "fibre", "stiffening", "relaxation", "plastic_set", "damage")
    points = MODELS[name](world, {n: hidden[n].scaled(KINDS[n].start) for n in inner})
    rng = np.random.default_rng(3)
    x = points.rest + 4e-4 * rng.standard_normal(points.rest.shape)
    v = 1e-3 * rng.standard_normal(points.rest.shape)
    for keep in (True, False):
        force = points.push(x, v, 0.5, 0.01, keep)
    assert np.abs(force.sum(0)).max() < 1e-9 * np.abs(force).sum()
    assert np.abs(np.cross(x, force).sum(0)).max() < 1e-9 * np.abs(np.cross(x, force)).sum()


def world_with_grip() -> World:
    world = block()
    return dataclasses.replace(world, grips=(grip(world),))


@pytest.mark.parametrize("name", MODELS)
def test_the_matrix_at_rest_is_the_slope_of_the_forces(name):
    points = MODELS[name](block(), {})
    stiff, damping = points.tangent()
    rng = np.random.default_rng(4)
    way = rng.standard_normal(points.rest.shape)
    still, tiny = np.zeros_like(way), 1e-8
    by_hand = (points.push(points.rest - tiny * way, still, 0.0, 0.01, False)
               - points.push(points.rest + tiny * way, still, 0.0, 0.01, False)) / (2 * tiny)  # fmt: skip
    assert stiff @ way.ravel() == pytest.approx(by_hand.ravel(), abs=1e-4 * np.abs(by_hand).max())
    by_hand = -points.push(points.rest, way, 0.0, 0.01, False)
    assert damping @ way.ravel() == pytest.approx(by_hand.ravel(), abs=1e-9 * np.abs(by_hand).max())


def stretched(points, share: float) -> np.ndarray:
    """Internal energy's slope along a uniform stretch, over its volume: the stress [Pa]."""
    F = np.diag([1 + share, 0, 0]) + np.diag([0, 1, 1])
    x = points.rest @ F.T
    force = points.push(x, np.zeros_like(x), 0.0, 0.01, False)
    return -np.einsum("ni,nj->ij", force, points.rest)


@pytest.mark.parametrize("name", MODELS)
def test_a_small_stretch_meets_the_elastic_constants(name):
    """Virial stress of a uniform uniaxial strain: lambda + 2 mu along, lambda across."""
    law = Material(4e3, 0.45, 0.0, 1000.0)
    points = MODELS[name](block(law), {})
    volume = points.mass.sum() / law.density
    stress = stretched(points, 1e-5) / volume / 1e-5
    lam = law.bulk - 2 * law.mu / 3
    close = 0.05 if name == "springs" else 1e-3
    assert stress[0, 0] == pytest.approx(lam + 2 * law.mu, rel=close)
    assert stress[1, 1] == pytest.approx(lam, rel=close)


@pytest.mark.parametrize(("kind", "close"), [("slab", 0.08), ("mound", 0.08), ("flap", 0.1), ("tube", 0.35)])
def test_springs_resist_shear_alike_in_all_directions(kind, close):
    """What was as stiff as it likes along some directions would be called fibres, and rightly."""
    body = bodies.draw(np.random.default_rng(0), kind, bodies.SUPPORTS[kind][0], 0.4)
    law = Material(4e3, 0.45, 0.0, 1000.0)
    points = Springs(dataclasses.replace(block(law), body=body), {})
    C = np.einsum("s,si,sj,sk,sl->ijkl", points.k * points.length**2, *4 * [points.way / points.length[:, None]])
    C /= points.mass.sum() / law.density
    frames = np.linalg.qr(np.random.default_rng(1).standard_normal((60, 3, 3)))[0]
    strain = np.stack([np.outer(f[0], f[0]) - np.outer(f[1], f[1]) for f in frames])
    shear = np.einsum("nij,ijkl,nkl->n", strain, C, strain) / 4
    assert shear == pytest.approx(law.mu, rel=close)


def test_shape_functions_are_one_at_their_node_and_sum_to_one():
    nodes = np.concatenate([np.eye(4), [[0.5 * (k in e) for k in range(4)] for e in
                                        ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))]])  # fmt: skip
    assert shapes(nodes) == pytest.approx(np.eye(10))
    assert shapes(np.random.default_rng(0).dirichlet(np.ones(4), 5)).sum(1) == pytest.approx(1)


def test_a_layer_that_is_let_go_swings_at_its_own_frequency():
    """Steps: a column that shears freely swings at sqrt(mu / rho) / (4 h); the steps keep it."""
    law = Material(2e3, 0.3, 0.0, 1000.0)
    world = block(law, frames=80, fps=2000.0)
    points = Tetrahedra(world, {})
    thick = world.body.thickness
    body = stepping._Moving(points, world, {})
    away = np.abs((points.rest - points.rest[points.held].mean(0)) @ stepping._normal(world))
    side = np.roll(stepping._normal(world), 1)
    swing = np.outer(np.sin(np.pi * away / (2 * thick)), side)
    body.x = [points.rest + 2e-5 * swing] * 2
    course = []
    for t in range(1, world.frames):
        body.frame(t)
        course.append(float((points.mass[:, None] * swing * (body.x[0] - points.rest)).sum()))
    crossing = np.flatnonzero(np.diff(np.sign(course)))[0]
    quarter = (crossing + 1 + course[crossing] / (course[crossing] - course[crossing + 1])) / world.fps
    # A finite block bends a little besides.
    assert quarter == pytest.approx(thick / np.sqrt(law.mu / law.density), rel=0.15)


@pytest.mark.parametrize("name", MODELS)
def test_everything_that_can_be_hidden_moves_the_body_and_nothing_at_magnitude_zero(name):
    engine = solver(name)
    world = dataclasses.replace(world_with_grip(), frames=11, split=9)
    plain = engine.paths(world, ())
    rng = np.random.default_rng(5)
    for effect in engine.CONCEALS:
        hidden = KINDS[effect].draw(world, rng, effect)
        if hidden.onset is not None:
            hidden = dataclasses.replace(hidden, onset=0.0, end=None if hidden.end is None else 0.6)
        if "jerks" in hidden.numbers:
            hidden = dataclasses.replace(hidden, numbers={"jerks": [0.2]})
        assert (engine.paths(world, (hidden.scaled(0.0),)) == plain).all(), effect
        # What has a threshold shows beyond it alone.
        share = 0.9 if effect in ("damage", "plastic_set") else 0.2
        moved = engine.paths(world, (hidden.scaled(share * KINDS[effect].most),))
        assert np.abs(moved - plain).max() > 4e-7, effect


@pytest.mark.parametrize("name", MODELS)
def test_numbers_that_a_diagnosis_is_held_against_are_all_there_or_the_solver_s_own(name):
    world, rng = world_with_grip(), np.random.default_rng(5)
    base = {"E": 4e3, "nu": 0.45, "eta": 20.0}
    for effect in set(solver(name).CONCEALS) & COMPARED.keys():
        hidden = KINDS[effect].draw(world, rng, effect).scaled(KINDS[effect].start)
        told = described(world, hidden, effect in solver(name).OWN)["parameters"]
        numbers = {key: entry["value"] for key, entry in told.items()}
        if not any(key.startswith("own ") for key in numbers):
            assert all(make(numbers, base) >= 0 for make in COMPARED[effect].values())


def test_steps_half_as_long_change_little(monkeypatch):
    world = world_with_grip()
    long = solver("tetrahedra").paths(world, ())
    monkeypatch.setattr(stepping, "LONGEST", 0.25 * stepping.LONGEST)
    short = solver("tetrahedra").paths(world, ())
    assert np.abs(long - short).max() < 0.03 * np.abs(short - short[:, :1]).max()


def test_worlds_differ_in_everything_and_an_axis_tells_nothing_of_another():
    worlds = [draw(generators(seed)) for seed in range(40)]
    for told in (
        {w.body.kind for w in worlds}, {g.course for w in worlds for g in w.grips},
        {g.handling for w in worlds for g in w.grips}, {len(w.grips) for w in worlds},
    ):  # fmt: skip
        assert len(told) >= 3
    assert min(w.fps for w in worlds) < 15 < 40 < max(w.fps for w in worlds)
    assert min(len(w.probes) for w in worlds) < 60 < 250 < max(len(w.probes) for w in worlds)
    # The same parts, whatever another part's generator gives.
    other = draw(lambda part: np.random.default_rng([0 if part != "material" else 99, *part.encode()]))
    assert (other.body.points == worlds[0].body.points).all()
    assert other.material != worlds[0].material


def test_an_oracle_sees_what_nothing_else_explains_and_no_more_points_than_err_apart():
    rng = np.random.default_rng(6)
    rest, seen = 0.02 * rng.standard_normal((20, 3)), rng.uniform(size=(20, 30)) < 0.9
    seeing = dataclasses.replace(seeing_of.draw(rng), sigma=1e-4, lasting=0.0, shared=0.0, offset=0.0, camera="still")
    base = [rng.standard_normal((20, 30, 3)) for _ in range(2)]
    plain = Oracle(rest, seen, seeing, base)
    assert plain.evidence(2e-4 * base[0]) == pytest.approx(0, abs=1e-4)
    d = 1e-4 * rng.standard_normal((20, 30, 3))
    assert plain.evidence(d) == pytest.approx(0.5 * 3 * (seen.sum() - 20), rel=0.06)
    # The same for all points, as neighbours err that see as one; with a short reach they are points apart.
    common = np.broadcast_to(1e-4 * rng.standard_normal((1, 30, 3)), d.shape)
    near, far = (
        Oracle(rest, seen, dataclasses.replace(seeing, shared=0.5, reach=reach), []).evidence(common)
        for reach in (1.0, 1e-3)
    )
    assert near < 0.12 * far
    assert far == pytest.approx(plain.evidence(common), rel=0.1)


def test_what_another_grip_would_do_is_nothing_to_an_oracle():
    world, engine, rng = block(), solver("springs"), np.random.default_rng(9)
    world = dataclasses.replace(world, grips=(grip(world),))
    plain = engine.paths(world, ())
    open_too = left_open(world, plain, engine)
    # Three numbers of the base, three grips, a lag and a scale; springs and pads, where this grip carries its points.
    assert len(open_too) == 3 + 3 + 2 + 2
    seeing = dataclasses.replace(seeing_of.draw(rng), sigma=2e-5, camera="still")
    seen = np.ones(plain.shape[:2], bool)
    pads = engine.paths(world.gripped(handling="pads"), ()) - plain
    alone, beside = (Oracle(world.rest, seen, seeing, base).evidence(pads) for base in ([], open_too))
    assert alone > 1
    assert beside < 1e-3 * alone


@pytest.mark.parametrize("camera", seeing_of.CAMERAS)
def test_an_oracle_knows_the_noise_that_is_drawn(camera):
    world = block(frames=6)
    world = dataclasses.replace(world, probes=world.probes[::3], weights=world.weights[::3])
    seeing = dataclasses.replace(
        seeing_of.draw(np.random.default_rng(3)), lasting=0.5, shared=0.4, reach=0.01, offset=0.7, swapped=0.0,
        tails=np.inf, camera=camera, shake=0.6,
    )  # fmt: skip
    rng, true = np.random.default_rng(4), np.repeat(world.rest[:, None], 6, 1)
    drawn = np.stack([seeing_of.observed(world, true, seeing, rng) - true for _ in range(3000)]) / seeing.sigma
    fitted = np.broadcast_to(np.arange(6) < 4, true.shape[:2])
    oracle = Oracle(world.rest, fitted, seeing, [])
    for _ in range(3):
        field = np.cumsum(rng.standard_normal(true.shape), 1) * fitted[..., None]
        d = field[fitted].ravel()
        constant = (UNKNOWN - seeing.offset**2) * (field.sum(1) ** 2).sum()
        seen = (drawn[:, fitted].reshape(len(drawn), -1) @ d).var()
        assert d @ oracle.covered(d) - constant == pytest.approx(seen, rel=0.12)


def test_a_camera_that_stands_still_adds_noise_of_the_size_that_is_said():
    world = block()
    true = np.repeat(world.rest[:, None], 200, 1)
    seeing = dataclasses.replace(seeing_of.draw(np.random.default_rng(7)), camera="still", offset=0.0, swapped=0.0)
    off = seeing_of.observed(world, true, seeing, np.random.default_rng(8)) - true
    assert off.std() == pytest.approx(seeing.sigma, rel=0.1)


def test_twenty_cases_hold_the_whole_mixture_and_every_law_comes_before_one_comes_again():
    engine = solver("springs")
    names = [concealed(Invent(family="springs", seed=3, case=case), engine) for case in range(40)]
    assert sum(n is None for n in names) == 12
    inside = [n for n in names if n and not KINDS[n].outside]
    assert len(inside) == 20
    assert len(set(inside[:12])) == 12


SHORT = {"tetrahedra": 42, "springs": 14, "lattice": 36}
"""Seeds whose first empty case is a small body and a short recording."""


@pytest.mark.slow(30)
@pytest.mark.parametrize("family", MODELS)
def test_a_case_is_a_recording_that_can_be_read_and_the_same_every_time(family, tmp_path):
    seed = SHORT[family]
    case = next(c for c in range(20) if concealed(Invent(family=family, seed=seed, case=c), solver(family)) is None)
    settings = Invent(family=family, seed=seed, case=case)
    made = invent(settings)
    assert made == invent(settings)
    for name, content in made.recording.items():
        (tmp_path / name).write_bytes(content)
    clip = read_recording(tmp_path)
    told = json.loads(made.truth)
    assert (told["kind"], told["family"], told["recording"]) == ("nothing", family, clip.name)
    with np.load(io.BytesIO(made.tracks)) as paths:
        off = np.nan_to_num(clip.points - paths["true"])[clip.visible]
    assert np.median(np.abs(off)) < 4 * told["noise"]


def test_what_is_recorded_does_not_depend_on_what_is_hidden():
    world, seeing = world_with_grip(), seeing_of.draw(np.random.default_rng(9))
    paths = np.repeat(world.rest[:, None], world.frames, 1)
    free = np.ones(paths.shape[:2], bool)
    first = recording(world, "r-1", paths, free, seeing)
    second = recording(world, "r-1", paths + 1e-3, free, seeing)
    assert [len(b) for b in first.values()] == [len(b) for b in second.values()]
    assert [n for n in first if first[n] != second[n]] == ["tracks.npz"]
