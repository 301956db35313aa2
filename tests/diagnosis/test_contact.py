"""What presses on a surface may be a contact; what draws tissue out of it is none."""

import numpy as np
import pytest
from planted import BLOB, GRID, block, case_of, memo_of, recording

from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis.candidates import blocks
from surgisim.diagnosis.contact import outward
from surgisim.diagnosis.diagnose import diagnose, search, sharpened
from surgisim.diagnosis.evidence import by_law
from surgisim.diagnosis.form import angles
from surgisim.diagnosis.law import NEVER
from surgisim.diagnosis.laws import law_of
from surgisim.physics.place import Place
from surgisim.recordings.mesh import Mesh
from surgisim.recordings.recording import Recording, no_grips

TOP = Place((0.0, 0.0, 0.010), 0.003)


def body(mesh=None, boxes=True) -> Recording:
    held = np.array([[[-0.1, -0.1, -1.0], [0.1, 0.1, 0.0025]]])
    return Recording(
        name="still", fps=10.0, mesh=mesh or block(), boxes=held if boxes else held[:0],
        points=np.zeros((1, 2, 3), np.float32), visible=np.ones((1, 2), bool), sigma=np.ones(1), motion=no_grips(2),
    )  # fmt: skip


@pytest.mark.parametrize(("force", "out"), [((0, 0, 2.0), 1.0), ((0, 0, -0.1), -1.0), ((3.0, 0, 0), 0.0)])
def test_out_of_the_surface_is_up_into_it_is_down_and_along_it_is_neither(force, out):
    assert outward(body(), TOP, np.array(force)) == pytest.approx(out, abs=0.02)


def test_a_side_may_be_pressed_on_from_its_side_alone():
    rim = Place((0.0165, 0.0, 0.006), 0.002)
    assert outward(body(), rim, np.array([-1.0, 0, 0])) < -0.8
    assert outward(body(), rim, np.array([1.0, 0, 0])) > 0.8


def test_a_thin_flap_may_be_pressed_on_from_both_sides():
    thin = Mesh(block().vertices * [1, 1, 0.15], block().faces)
    here = Place((0.0, 0.0, 0.0009), 0.003)
    assert outward(body(thin, boxes=False), here, np.array([0, 0, 1.0])) == pytest.approx(0.0, abs=0.05)
    # Where a box holds all of it, nothing can press on it.
    assert outward(body(thin), here, np.array([0, 0, 1.0])) == 0.0


def test_deep_inside_nothing_is_said():
    thick = Mesh(block().vertices * [10, 10, 10], block().faces)
    assert outward(body(thick, boxes=False), Place((0.0, 0.0, 0.06), 0.003), np.array([0, 0, 1.0])) == 0.0


@pytest.mark.slow(80)
def test_what_draws_tissue_outward_is_not_called_a_contact():
    settings = Diagnosing(
        grid=GRID, replay=GRID, nulls=8, experiment=False, free=0, second=False, refine=1, residual=False
    )
    push = {"hidden_contact": {"force": 0.12, "yaw": 0.3, "pitch": 0.2, "onset": 0.7, "end": 1.4}}
    planted = recording(push, {"hidden_contact": BLOB})
    drawn, physics, _ = diagnose(planted, settings, lambda *_: None, memo_of(planted))
    assert drawn.global_test["outward"] > 0.5
    assert drawn.verdict == "unexplained"
    assert drawn.effects[0]["probability"] < 0.5
    assert "hidden_contact" not in physics.terms
    assert "draws the tissue out of its surface at 1" in drawn.words


@pytest.mark.slow(65)
def test_a_push_that_stays_comes_out_with_the_sign_it_has():
    # Constants projected out, it is nearly the opposite push up to its onset.
    force = np.array([0.02, 0.03, -0.1])
    yaw, pitch = angles(force)
    push = {"force": float(np.linalg.norm(force)), "yaw": yaw, "pitch": pitch, "onset": 1.13, "end": NEVER}
    case = case_of(recording({"hidden_contact": push}, {"hidden_contact": BLOB}))
    clip = case.clip
    tried = blocks(clip, case.base, case.memo, np.array(BLOB.center))
    law = by_law(search(case, case.z, case.nulls, lambda *_: None, [p for p in tried if p[0].startswith("pushes")]))
    assert all(f.hypothesis.mix.reshape(3, -1, 3)[0, 0, 0] == 0 for f in law["hidden_contact"].findings)
    best = law["hidden_contact"].best
    assert best.hypothesis.end is None
    assert best.hypothesis.onset == pytest.approx(1.07, abs=0.15)
    assert best.amplitude @ force > 0.9 * np.linalg.norm(best.amplitude) * np.linalg.norm(force)
    found, _ = sharpened(case, law["hidden_contact"], case.z)
    assert law_of(found.hypothesis, found.amplitude, clip).values["hidden_contact"]["end"] == NEVER
    assert outward(clip.recording, found.hypothesis.place, found.amplitude) < -0.5
