"""Real recordings whose makers know the cause: how they are turned into recordings, and what is asked."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from surgisim.artifacts.verdict import Effect, Verdict
from surgisim.physics.catalogue import choose
from surgisim.problem import Problem
from surgisim.proof.known.catalogue import Found, answered, catalogue, chosen
from surgisim.proof.rigs.pressed_cube import Pressed, stress
from surgisim.recordings.folder import encoded_recording, read_recording
from surgisim.recordings.xls import read_xls
from surgisim.report.board.known import page


def found(*effects: Effect, verdict: str = "named") -> Found:
    return Found(Verdict("r", verdict, effects, (), None, (), {}, {}, None, ""), {})


@pytest.mark.shared
@pytest.mark.parametrize("name", sorted(n for n, k in catalogue().items() if k.convert))
def test_a_recording_says_nothing_of_its_cause(shared, tmp_path, name):
    known = chosen(name)
    files = encoded_recording(known.convert(shared / "data" / known.data))
    for path, content in files.items():
        assert b"load52" not in content
        (tmp_path / path).write_bytes(content)
    recording = read_recording(tmp_path)
    assert recording.name in ("take", "beam")
    assert set(json.loads(files["recording.json"])) == {
        "format", "name", "fps", "frames", "length_unit", "density_kg_m3", "gravity_m_s2", "tier", "starts"
    }  # fmt: skip


@pytest.mark.shared
def test_the_beams_end_moves_with_its_markers(shared):
    for name, drop in (("beam_damping", 6.3e-3), ("beam_load", 16.5e-3)):
        recording = chosen(name).convert(shared / "data" / "silicone_beam_mocap")
        moved = recording.points.astype(float) - recording.attached()[:, None]
        assert recording.starts == "released"
        assert np.abs(moved[:, 0]).max() < 1e-8
        assert -moved[:, -1, 0].mean() == pytest.approx(drop, rel=0.03)
        apart = np.linalg.norm(recording.points[0] - recording.points[3], axis=-1)
        # Rigid, but for the makers' places of the markers: up to 2 mm off, turned by up to 0.3.
        assert np.ptp(apart) < 0.02 * apart[0]


@pytest.mark.shared
def test_the_bar_of_two_silicones_bends_in_its_soft_half(shared):
    recording = chosen("silicone_halves").convert(shared / "data" / "diffcal_silicone")
    first, last = recording.points[:, 0].astype(float), recording.points[:, -1].astype(float)
    assert (np.abs(first - recording.place) < 1e-8).all()
    slope = np.degrees(np.arctan2(-np.diff(last[:, 1]), -np.diff(last[:, 0])))
    soft, stiff = slope[recording.place[1:, 0] > 0], slope[recording.place[1:, 0] < 0]
    assert np.ptp(soft) > 15 > 6 > np.ptp(stiff)
    assert recording.mesh.volume == pytest.approx((12 * 9 + 2 * 4 * 18 - 18) * 1e-6)
    assert recording.body(0.01).held.sum() == 432


def test_the_soft_half_may_be_said_either_way(tmp_path):
    ask = chosen("silicone_halves").ask
    for factor, x, right in ((0.5, 0.03, True), (2.0, -0.03, True), (2.0, 0.03, False), (0.5, -0.03, False)):
        lump = Effect("stiff_inclusion", 0.9, center=(x, 0.0, 0.0), parameters={"s": {"value": factor, "unit": "1"}})
        half, size = ask(tmp_path, found(lump))[1:]
        assert (half.met, size.met) == (right, True)


def test_a_soft_part_is_asked_where_it_begins_and_how_soft_it_is(tmp_path):
    ask = chosen("silicone_halves").ask

    def answers(x: float, factor: float) -> list[bool]:
        part = Effect("stiff_inclusion", 0.9, center=(x, 0.0, 0.0), parameters={"s": {"value": factor, "unit": "1"}})
        told = found(part)
        beyond = {"stiff_inclusion": {"center": [x, 0.0, 0.0], "extent": 0.004, "normal": [1.0, 0.0, 0.0]}}
        return [a.met for a in ask(tmp_path, replace(told, physics={"places": beyond}))]

    assert answers(0.01, 0.4) == [True, True, True, True]
    assert answers(0.03, 0.1) == [True, True, False, False]


def test_a_load_is_asked_for_its_place_and_mass(tmp_path):
    ask = chosen("beam_load").ask
    at_end = Effect(
        "added_mass", 0.9, center=(0.015, 0.015, 0.012), parameters={"mass": {"value": 0.047, "unit": "kg"}}
    )
    assert [a.met for a in ask(tmp_path, found(at_end))] == [True, True, True]
    pushed = Effect("hidden_contact", 0.9, center=(0.0, 0.0, 0.03), parameters={"force": {"value": 0.3, "unit": "N"}})
    assert [a.met for a in ask(tmp_path, found(pushed))] == [True, False, False]
    assert [a.met for a in ask(tmp_path, found(Effect("fibre", 0.9)))] == [False]
    assert [a.met for a in ask(tmp_path, found(verdict="unexplained"))] == [False]


def test_no_damping_named_is_no_prediction(tmp_path):
    assert [a.met for a in chosen("beam_damping").ask(tmp_path, found(verdict="nothing detectable"))] == [False]


def test_a_pressed_neo_hookean_cube_follows_its_closed_form():
    stretch = np.linspace(1, 0.7, 12)
    tests = Pressed(np.linspace(0, 1, 12)[None], stretch[None], np.array([1]))
    values = {"neo_hookean": {"E": 1000.0, "nu": 0.4999}}
    mu = 1000.0 / (2 * 1.4999)
    assert stress(choose(values), values, tests)[0] == pytest.approx(
        mu * (stretch**2 - 1 / stretch), rel=2e-3, abs=1e-3
    )


def test_a_held_cube_relaxes_to_its_springs_and_forgets_the_branch():
    time = np.concatenate([np.linspace(0, 0.05, 8), np.geomspace(0.06, 60, 40)])
    tests = Pressed(time[None], np.interp(time, [0, 0.05], [1, 0.9])[None], np.array([0]))
    base = {"neo_hookean": {"E": 1000.0, "nu": 0.48}}
    values = base | {"relaxation": {"G": 400.0, "tau": 2.0}}
    held = stress(choose(values), values, tests)[0]
    assert held[-1] == pytest.approx(stress(choose(base), base, tests)[0, -1], rel=1e-6)
    fading = (held[8:] - held[-1]) / (held[7] - held[-1])
    assert fading == pytest.approx(np.exp(-(time[8:] - 0.05) / 2.0), abs=0.02)


def test_fibres_resist_what_stretches_them_only():
    tests = Pressed(np.tile([0.0, 1.0], (2, 1)), np.array([[1, 0.8]] * 2), np.array([0, 1]))
    base = {"neo_hookean": {"E": 1000.0, "nu": 0.48}}
    values = base | {"fibre": {"k1": 2000.0, "k2": 0.5, "yaw": np.pi / 2, "pitch": 0.0}}
    along, across = stress(choose(values), values, tests)[:, -1]
    plain = stress(choose(base), base, tests)[0, -1]
    assert along == pytest.approx(plain, rel=1e-9)
    assert across < 1.2 * plain


@pytest.mark.shared
def test_an_old_workbook_is_read(shared):
    book = read_xls(shared / "data" / "tissue_mechanical_tests" / "muscle_rate_vals.xls")
    assert list(book) == ["F_005", "F_01", "F_05", "XF_005", "XF_01", "XF_05"]
    last = book["F_01"][-1]
    assert last == pytest.approx([328.3695, -0.5202, 0.7], abs=5e-4)
    assert book["F_005"][2, 4] == 12


def test_what_is_no_workbook_is_one_sentence(tmp_path):
    for content in (b"PK\x03\x04zipped", bytes.fromhex("d0cf11e0a1b11ae1") + bytes(600)):
        (tmp_path / "a.xls").write_bytes(content)
        with pytest.raises(Problem, match=r"a\.xls: is (not an|a damaged)"):
            read_xls(tmp_path / "a.xls")


@pytest.mark.shared
@pytest.mark.slow
def test_muscle_is_found_to_relax_and_to_have_fibres(shared, monkeypatch):
    # The two that pay most; what comes after them is not asked.
    monkeypatch.setattr("surgisim.proof.rigs.pressed_muscle.ROUNDS", 2)
    known = chosen("muscle")
    told = answered("muscle", known.direct(shared / "data" / known.data, lambda *_: None), lambda folder: Path(folder))
    assert [a["met"] for a in told["answers"]] == [True, True, True]
    text = page([told]).decode()
    assert "3</b> of <b>3" in text


def test_an_unknown_recording_is_one_sentence():
    with pytest.raises(Problem, match="no real recording is called 'bem'"):
        chosen("bem")
