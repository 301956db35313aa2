"""What has no name: planted, it is found again and predicts; where nothing is, nothing is found; it never names."""

from dataclasses import replace

import numpy as np
import pytest
from planted import GRID, SLOWLY, case_of, memo_of, plain, recording

from surgisim.artifacts.character import Truly
from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis import candidates, judgement
from surgisim.diagnosis import verdict as judging
from surgisim.diagnosis.diagnose import diagnose
from surgisim.diagnosis.evidence import by_law
from surgisim.diagnosis.laws import law_of
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.prospect import Gain
from surgisim.diagnosis.residual import courses, forms
from surgisim.diagnosis.residual.character import energy
from surgisim.diagnosis.residual.courses import Course
from surgisim.diagnosis.residual.fit import findings, pays
from surgisim.diagnosis.residual.forms import residual_force, residual_stress
from surgisim.diagnosis.residual.model import modelled
from surgisim.diagnosis.scopes import Where
from surgisim.physics.catalogue import catalogue as terms
from surgisim.physics.place import Place

SPOT = Place((0.006, 0.004, 0.008), 0.005)
SWELLS = {"xx": -1200.0, "yy": -1200.0, "zz": -1200.0, "xy": 0.0, "xz": 0.0, "yz": 0.0}
PLANTED = {
    "values": {"residual_stress": {**SWELLS, **Course(0.9, rise=0.8).numbers}}, "places": {"residual_stress": SPOT},
}  # fmt: skip
OTHERS = ("residual_stiffness", "residual_fading")


def quiet(*_):
    pass


def added(case, block) -> np.ndarray:
    """A whitened residual of nothing with a block's first hypothesis in it, as large as can be seen."""
    field = np.tensordot(block.hypotheses[0].mix[:, 0], block.written_out, (0, 0))
    size = 4e-4 / np.sqrt((field**2).sum(-1).mean())
    return case.nulls[:, 0] + case.whiten(size * field)


def best_of(case, z, taken):
    laws = by_law(findings(case, z, taken, quiet))
    return laws, max(laws.values(), key=lambda score: score.evidence).best.hypothesis


@pytest.mark.slow
@pytest.mark.parametrize("form", ["residual_force", "residual_stress"])
def test_what_is_planted_on_the_tangent_is_found_with_its_place_and_its_course(form):
    case, course = plain(), Course(0.85, rise=0.6)
    look = Look(case.clip, case.base)
    if form == "residual_force":
        block = residual_force._exact(look, [(SPOT, course)])
    else:
        block = residual_stress._exact(look, [(Where("blob", SPOT), course)], "pressure")
    laws, best = best_of(case, added(case, block), OTHERS)
    assert best.term == form
    assert np.linalg.norm(np.subtract(best.place.center, SPOT.center)) < 0.008
    # What rises slowly and late is the same as what rises fast and a little later.
    assert best.onset + best.about["rise"] / 2 == pytest.approx(course.onset + course.rise / 2, abs=0.25)
    assert pays(laws, case)


@pytest.mark.slow
def test_where_nothing_is_no_form_pays():
    case = plain()
    for null in case.nulls.T[:2]:
        assert not pays(by_law(findings(case, null, OTHERS, quiet)), case)


def test_every_form_is_a_law_that_the_engine_has():
    assert set(forms.catalogue()) <= set(terms())
    assert not set(forms.catalogue()) & set(candidates.catalogue())
    case = plain()
    look = Look(case.clip, case.base, only=np.array(SPOT.center))
    found = {}
    for _, make in candidates.without_a_name(look):
        for block in make():
            assert np.isfinite(block.written_out).all()
            found |= {(h.term, h.about.get("kind"), h.scope, h.onset is None): h for h in block.hypotheses}
    assert {term for term, *_ in found} == set(forms.catalogue())
    for h in found.values():
        amplitude = np.full(h.mix.shape[1], 0.1)
        values = law_of(h, amplitude, case.clip).values[h.term]
        assert set(values) == set(terms()[h.term].params)
        assert candidates.of(h).knobs(h, amplitude)


@pytest.mark.parametrize(
    "course",
    [Course(0.5), Course(0.5, rise=4.0), Course(0.5, fade=0.4), Course(0.5, end=1.5), Course(-100.0, rhythm=1.0)],
)
def test_a_course_goes_on_after_the_last_fitted_frame(course):
    early, late = course.on(np.linspace(0, 2, 41)), course.on(np.linspace(2, 6, 81))
    assert early[0] == 0
    assert np.isfinite(late).all()
    assert np.abs(np.diff(late)).max() < 0.5
    if course.rhythm == 0 and course.end is None and course.fade > 10 and course.rise < 1:
        assert np.allclose(late, late[0], atol=0.05)


def test_a_course_is_among_those_around_it():
    case = plain()
    for course in courses.tried(case.clip):
        assert course in list(courses.near(course, 1.0))


@pytest.mark.parametrize(
    ("work", "said"),
    [([2.0, 1.0, -0.1], "gives"), ([-1.0, 0.2, -2.0], "takes"), ([1.0, -1.1, 1.0, -0.9], "neither")],
)
def test_the_sign_of_the_work_says_who_gives_energy(work, said):
    assert energy(np.array(work)) == said


def test_a_character_is_right_where_all_that_is_asked_is():
    said = {"at_rest": True, "change": "grows", "energy": "takes", "local": True, "period": None}
    truth = Truly(at_rest=(True, None), change=("grows",), energy=("gives",))
    assert truth.right(said) == {"at_rest": True, "change": True, "energy": False, "periodic": True}


@pytest.fixture(scope="module")
def swollen():
    case = case_of(recording(**PLANTED, fps=SLOWLY), free=0, replay=GRID)
    return case, modelled(case, quiet)


@pytest.mark.slow
def test_a_swelling_that_no_law_names_is_modelled_and_the_frames_held_out_come_nearer(swollen):
    _, found = swollen
    assert found.helps
    held = found.told["held_out"]
    assert held["before"] - held["after"] > 0.4 * (held["before"] - held["noise_floor"])
    (law,) = found.told["laws"]
    assert law["term"] == "residual_stress"
    assert np.linalg.norm(np.subtract(law["place"]["center"], SPOT.center)) < 0.006
    how = found.told["character"]
    assert (how["at_rest"], how["energy"], how["local"], how["period"]) == (True, "gives", True, None)
    assert "falls from" in found.words


@pytest.mark.slow
def test_a_law_without_a_name_that_does_not_predict_is_not_modelled(swollen):
    case, _ = swollen
    upside_down = replace(case.clip, moved=case.clip.moved.copy())
    upside_down.moved[:, case.clip.until :] *= -1
    found = modelled(replace(case, clip=upside_down), quiet)
    assert not found.helps
    assert "is not modelled" in found.words


@pytest.mark.slow
def test_no_verdict_depends_on_a_law_without_a_name_and_physics_has_it_where_it_predicts(monkeypatch):
    judged = judging.judged
    worse = Gain(-50.0, -80.0, -20.0, 60.0)
    monkeypatch.setattr(
        judging, "judged", lambda case, laws, tried, over=None, w=False: judged(case, laws, tried, worse)
    )
    monkeypatch.setattr(judgement, "borne_out", lambda *_: 0.6)
    made = recording(**PLANTED, fps=SLOWLY)
    settings = Diagnosing(grid=GRID, replay=GRID, nulls=8, experiment=False, free=0, second=False)
    (with_it, physics, _), (without, bare, _) = (
        diagnose(made, settings.model_copy(update={"residual": on}), quiet, memo_of(made)) for on in (True, False)
    )
    assert with_it.verdict == without.verdict == "unexplained"
    assert with_it.effects == without.effects
    assert with_it.ranking == without.ranking
    assert (without.residual, set(bare.terms)) == ({}, {"neo_hookean_ciarlet", "newtonian"})
    assert with_it.residual["helps"]
    assert "residual_stress" in physics.terms
    assert with_it.words == f"{without.words} {with_it.residual['words']}"
