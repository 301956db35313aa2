"""Concealed recordings: what they hold, what they do not tell, and how the answer is sealed."""

import dataclasses
import hashlib
import io
import json
import math
from collections import Counter

import numpy as np
import pytest

from surgisim.config.invent import Invent
from surgisim.phantom import nuisance, seal
from surgisim.phantom.blind import Aim, at_once, borne, invent, name_of
from surgisim.phantom.effect import Hidden, catalogue
from surgisim.phantom.follow import follow
from surgisim.phantom.mixture import concealed
from surgisim.phantom.model import model
from surgisim.phantom.scene import draw
from surgisim.phantom.snr import scaled
from surgisim.problem import Problem

# Coarse and few, so that a case takes seconds.
QUICK = Invent(seed=4, case=3, points=40, spacing=5.5e-3, spacing_coarse=6.5e-3, snr_low=1.0, snr_high=2.0)


def read(raw: bytes) -> dict[str, np.ndarray]:
    return dict(np.load(io.BytesIO(raw), allow_pickle=False))


@pytest.fixture(scope="module")
def empty():
    return invent(QUICK, names=())


@pytest.fixture(scope="module")
def tilted():
    return invent(QUICK, names=("gravity",))


def test_the_same_seed_and_case_are_the_same_recording_and_truth(empty):
    assert invent(QUICK, names=()) == empty


def test_an_empty_case_conceals_nothing(empty):
    truth, paths = json.loads(empty.truth), read(empty.tracks)
    assert (truth["kind"], truth["effects"], truth["snr"]) == ("nothing", [], 0)
    assert (paths["plain"] == paths["true"]).all()


def test_an_effect_is_as_strong_as_it_was_asked_to_be(tilted):
    truth = json.loads(tilted.truth)
    asked = truth["effects"][0]["snr_asked"]
    assert QUICK.snr_low <= asked <= QUICK.snr_high
    assert truth["snr"] == pytest.approx(asked, rel=0.15)
    visible = read(tilted.recording["tracks.npz"])["visible"]
    paths = read(tilted.tracks)
    span = json.loads(tilted.recording["split.json"])["fit"][1]
    gap = (paths["true"] - paths["plain"])[:, :span][visible[:, :span]]
    assert np.sqrt((gap**2).sum(-1).mean()) / QUICK.noise == pytest.approx(truth["snr"], rel=1e-4)


def test_only_the_paths_differ_between_an_effect_and_none(empty, tilted):
    assert empty.recording.keys() == tilted.recording.keys()
    for name in empty.recording.keys() - {"tracks.npz"}:
        assert empty.recording[name] == tilted.recording[name], name
    without, with_it = (read(one.recording["tracks.npz"]) for one in (empty, tilted))
    assert len(empty.recording["tracks.npz"]) == len(tilted.recording["tracks.npz"])
    assert (without["visible"] == with_it["visible"]).all()
    assert (without["sigma"] == with_it["sigma"]).all()
    assert not (without["points"] == with_it["points"]).all()


def test_nothing_in_the_folder_names_the_effect(tilted):
    for name, raw in tilted.recording.items():
        assert not any(effect.encode() in raw for effect in catalogue() if effect != "gravity"), name
    assert b"change" not in tilted.recording["recording.json"]
    assert set(json.loads(tilted.recording["recording.json"])) == {
        "format", "name", "fps", "frames", "length_unit", "density_kg_m3", "gravity_m_s2", "tier", "starts"
    }  # fmt: skip


def test_names_are_opaque_and_differ():
    names = [name_of(seed, case) for seed in range(5) for case in range(40)]
    assert len(set(names)) == len(names)
    assert {len(n) for n in names} == {10}


def test_the_rest_shape_is_closed_and_stands_on_its_held_plate(empty):
    raw = empty.recording["rest.ply"]
    head, body = raw.split(b"end_header\n", 1)
    counts = [int(line.split()[2]) for line in head.decode().splitlines() if line.startswith("element")]
    vertices = np.frombuffer(body, "<f8", 3 * counts[0]).reshape(-1, 3)
    faces = np.frombuffer(body, [("n", "u1"), ("v", "<i4", 3)], counts[1], 24 * counts[0])["v"]
    edges = Counter(map(tuple, np.stack([faces, np.roll(faces, -1, 1)], -1).reshape(-1, 2)))
    assert all(edges[b, a] == 1 for (a, b), times in edges.items() if times == 1)
    assert set(edges.values()) == {1}
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    assert (np.cross(a, b) * c).sum() > 0
    box = json.loads(empty.recording["fixed.json"])["boxes"][0]
    held = ((vertices >= np.array(box["min"]) - 1e-9) & (vertices <= np.array(box["max"]) + 1e-9)).all(1)
    depth = vertices[held, 2].max() - vertices[:, 2].min()
    assert depth == pytest.approx(3e-3)


def test_the_reader_of_recordings_accepts_the_folder(empty, tmp_path):
    folder = pytest.importorskip("surgisim.recordings.folder")
    for name, raw in empty.recording.items():
        (tmp_path / name).write_bytes(raw)
    found = folder.read_recording(tmp_path)
    assert found.frames == found.motion.active.shape[1]
    body = found.body(4e-3)
    assert 0.05 < body.held.mean() < 0.5


def test_tools_hide_points_and_every_first_frame_is_seen(empty):
    tracks, grips = read(empty.recording["tracks.npz"]), read(empty.recording["grip.npz"])
    assert tracks["visible"][:, 0].all()
    assert np.isnan(tracks["points"][~tracks["visible"]]).all()
    assert np.isfinite(tracks["points"][tracks["visible"]]).all()
    t = int(np.flatnonzero(grips["active"][0])[-1])
    away = np.linalg.norm((tracks["points"][:, t] - grips["position"][0, t])[:, :2], axis=1)
    assert np.nanmin(away) > 0.6 * grips["radius"][0]


def test_noise_has_its_size_lasts_and_is_shared_by_neighbours():
    scene = draw(np.random.default_rng(2), fps=25, points=60, spacings=(6e-3,))
    still = np.repeat(scene.shape.upper(scene.probes)[:, None], 120, 1)
    off = nuisance.seen(still[:, 0], still, 3e-4, np.random.default_rng(3)) - still
    offset = off.mean(1, keepdims=True)
    noise = off - offset
    assert noise.std() == pytest.approx(3e-4, rel=0.15)
    assert offset.std() == pytest.approx(nuisance.OFFSET * 3e-4, rel=0.3)
    unit = noise / noise.std(axis=(1, 2), keepdims=True)
    assert (unit[:, 1:] * unit[:, :-1]).mean() > 0.2
    away = np.linalg.norm(still[:, None, 0] - still[None, :, 0], axis=-1)
    alike = np.einsum("ktc,jtc->kj", unit, unit) / unit[0].size
    assert alike[(away > 0) & (away < 5e-3)].mean() > alike[away > 0.02].mean() + 0.1


def test_twenty_cases_hold_the_whole_mixture():
    outside = {n for n, e in catalogue().items() if e.outside}
    for seed in range(3):
        for block in range(3):
            cases = [concealed(seed, c) for c in range(20 * block, 20 * block + 20)]
            assert sum(not c for c in cases) == 4
            assert sum(len(c) == 2 and c[0] != c[1] for c in cases) == 3
            assert sum(bool(set(c) & outside) for c in cases) == 3
        singles = Counter(n for c in range(80) for n in concealed(seed, c) if len(concealed(seed, c)) == 1)
        inside = [n for n, e in catalogue().items() if not e.outside and not e.faint]
        assert all(singles[n] >= 2 for n in inside)
    assert [concealed(1, c) for c in range(20)] != [concealed(2, c) for c in range(20)]


def test_the_place_of_a_kind_in_the_deck_changes_from_block_to_block():
    empties = [tuple(c % 20 for c in range(b, b + 20) if not concealed(7, c)) for b in range(0, 100, 20)]
    assert len(set(empties)) > 1


def test_a_search_of_strength_meets_curves_thresholds_and_what_breaks():
    curves = {
        "saturating": lambda m: 4 * m / (1 + m),
        "with a threshold": lambda m: max(m - 0.5, 0.0) ** 1.5,
        "breaking": lambda m: 3 * m if m < 0.9 else np.inf,
    }
    for name, curve in curves.items():
        assert scaled(curve, 2.0, start=0.3, most=50).ratio == pytest.approx(2.0, rel=0.08), name
    assert scaled(lambda m: m, 9.0, start=1.0, most=3.0).magnitude == pytest.approx(3.0)


def test_the_seal_holds_the_truth_and_no_other(tilted):
    salt = seal.salt()
    sealed = seal.seal(tilted.truth, salt)
    seal.verify(tilted.truth, salt, sealed)
    assert sealed == hashlib.sha256(tilted.truth + salt.encode()).hexdigest()
    for truth, key in ((tilted.truth.replace(b"gravity", b"tether"), salt), (tilted.truth, seal.salt())):
        with pytest.raises(Problem, match="seal"):
            seal.verify(truth, key, sealed)
    assert json.loads(tilted.truth)["tracks_sha256"] == hashlib.sha256(tilted.tracks).hexdigest()


def test_every_part_of_an_effect_can_be_told_in_json():
    scene = draw(np.random.default_rng(0), fps=25, points=10, spacings=(6e-3,))
    for name, effect in catalogue().items():
        hidden = effect.draw(scene, np.random.default_rng(1), name)
        told = dataclasses.asdict(hidden) | {"center": None}
        assert json.loads(json.dumps(told))["name"] == name
        assert hidden.onset is None or 0 <= hidden.onset < scene.end_of_fit
        assert hidden.end is None or hidden.onset < hidden.end <= scene.end_of_fit


def test_two_effects_that_tissue_does_not_bear_at_once_are_weaker():
    aims = (Aim(Hidden("gravity", 8.0), 3.0, 3.0), Aim(Hidden("tool_slip", 0.9), 3.0, 3.0))

    def measure(*hidden):
        load = sum(h.magnitude / (8.0 if h.name == "gravity" else 0.9) for h in hidden)
        return math.inf if load > 1.5 else load

    weaker, ratio = at_once(aims, measure)
    assert ratio == pytest.approx(2 * 0.8**2)
    assert [a.hidden.magnitude for a in weaker] == pytest.approx([8.0 * 0.8**2, 0.9 * 0.8**2])
    assert [a.alone for a in weaker] == pytest.approx([0.8**2, 0.8**2])
    assert at_once(weaker, measure) == (weaker, ratio)


@pytest.mark.slow
def test_pulls_that_tear_tissue_are_shortened_and_others_are_not():
    spacings = QUICK.spacing, QUICK.spacing_coarse
    scene = draw(np.random.default_rng(5), fps=QUICK.fps, points=QUICK.points, spacings=spacings)
    assert borne(scene, spacings, None)[0] == scene
    far = scene.pulled(6.0)
    with pytest.raises(Problem, match="inside out"):
        follow(model(far, QUICK.spacing))
    shorter, _, paths = borne(far, spacings, None)
    share = [np.linalg.norm(s.pull) / np.linalg.norm(f.pull) for s, f in zip(shorter.holds, far.holds, strict=True)]
    assert share[0] == pytest.approx(share[1])
    assert math.log(share[0]) / math.log(0.8) == pytest.approx(round(math.log(share[0]) / math.log(0.8)))
    assert all(np.isfinite(path).all() for path in paths)
