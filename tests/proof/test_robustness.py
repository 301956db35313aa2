"""Verdicts on perturbed recordings, scored with a key and without."""

import json

import pytest
from made_up import diagnosis

from surgisim.artifacts.verdict import read_verdict
from surgisim.problem import Problem
from surgisim.proof.metamorphic import metamorphic
from surgisim.proof.perturb.names import AS_IS
from surgisim.proof.robustness import bodies, cell, robustness
from surgisim.report.board import metamorphic as keyless
from surgisim.report.board.robustness import page, picture, words

NAMES = [AS_IS, "release+1", "drift1"]
SAID = {
    # body: concealed, then what is said with its probability as it is, released later, and with a drift
    0: (None, "nothing detectable", "unexplained", ("tether", 0.8)),
    1: ("tether", ("tether", 0.9), "nothing detectable", ("fibre", 0.7)),
    2: ("fibre", ("fibre", 0.6), ("fibre", 0.6), ("gravity", 0.4)),
    3: ("gravity", "unexplained", ("gravity", 0.9), None),
}


def told(said, evidence=30.0) -> dict:
    if isinstance(said, str):
        return diagnosis() | {"verdict": said, "effects": [], "global_test": {"log_evidence": evidence}}
    effect = diagnosis()["effects"][0] | {"term": said[0], "probability": said[1], "runners_up": []}
    effect["log_evidence"] = evidence - 2
    return diagnosis() | {"verdict": "named", "effects": [effect], "global_test": {"log_evidence": evidence}}


@pytest.fixture
def folder(tmp_path):
    for body, (concealed, *said) in SAID.items():
        effects = [{"term": concealed}] if concealed else []
        truth = {"recording": f"r-{body}", "effects": effects, "snr": 3.0 if concealed else 0.0}
        (tmp_path / str(body) / "sealed").mkdir(parents=True)
        (tmp_path / str(body) / "sealed" / "truth.json").write_text(json.dumps(truth))
        for n, (name, what) in enumerate(zip(NAMES, said, strict=True)):
            if what is not None:
                (tmp_path / str(body) / name).mkdir()
                (tmp_path / str(body) / name / "diagnosis.json").write_text(json.dumps(told(what, 30.0 + n)))
    return tmp_path


def test_names_that_stay_are_withdrawn_or_turn_are_counted_apart(folder):
    found = robustness(folder, list(SAID), NAMES)

    def counted(perturbation, *keys):
        shares = found["figures"][perturbation]
        return [(shares[k]["hits"], shares[k]["count"]) for k in keys]

    assert counted(AS_IS, "silent", "right", "withdrawn") == [(1, 1), (2, 3), (1, 3)]
    assert counted("release+1", "silent", "false_names", "right", "withdrawn") == [(0, 1), (0, 1), (2, 3), (1, 3)]
    assert counted("release+1", "kept", "lost", "turned") == [(1, 2), (1, 2), (0, 2)]
    # The drift of body 3 was not diagnosed.
    assert counted("drift1", "false_names", "wrong", "wrong_sure", "turned", "turned_sure") == [
        (1, 1), (2, 2), (1, 2), (2, 2), (1, 2)
    ]  # fmt: skip
    over = found["perturbed"]
    assert (over["silent"]["hits"], over["silent"]["count"], over["kept"]["count"]) == (0, 2, 4)
    assert 0 < over["silent"]["high"] < 1


def test_a_class_is_right_where_it_holds_the_truth(tmp_path):
    both = told(("tether", 0.6))
    both["effects"].append({"term": "fibre", "probability": 0.4})
    for verdict, outcome in (("equivalence class", "right"), ("named", "wrong")):
        (tmp_path / "d.json").write_text(json.dumps(both | {"verdict": verdict}))
        assert cell(read_verdict(tmp_path / "d.json"), "fibre")["outcome"] == outcome


def test_two_sets_stand_side_by_side(folder):
    now = robustness(folder, list(SAID), NAMES)
    before = robustness(folder, list(SAID), NAMES, folder / "none")
    text = words(now, before)
    assert "before: –" in text
    assert "name kept" in text
    html = page(now, before).decode()
    assert html.count('<table class="matrix">') == 2
    assert 'class="wrong"' in html
    assert picture(now, None).startswith(b"\x89PNG")


def test_what_conceals_two_laws_is_refused(folder):
    truth = folder / "1" / "sealed" / "truth.json"
    truth.write_text(json.dumps(json.loads(truth.read_text()) | {"effects": [{"term": "a"}, {"term": "b"}]}))
    with pytest.raises(Problem, match="two laws"):
        robustness(folder, list(SAID), NAMES)


def test_a_third_of_the_bodies_conceals_nothing_and_no_law_comes_twice_before_all_have_come():
    from surgisim.phantom.mixture import concealed
    from surgisim.proof.robustness import LAWS

    chosen = bodies(907001, 12)
    names = [concealed(907001, case, LAWS) for case in chosen]
    assert sum(not n for n in names) == 4
    assert len({n for n in names if n}) == 8


def test_without_a_key_names_that_appear_and_evidence_that_moves_are_told(folder):
    found = metamorphic(folder, [str(body) for body in SAID], NAMES)
    over, drift = found["perturbed"], found["figures"]["drift1"]
    assert (over["became"]["hits"], over["became"]["count"]) == (2, 3)
    assert (drift["changed"]["hits"], drift["changed"]["count"]) == (2, 2)
    assert drift["change"] == {
        "count": 3,
        "quantiles": pytest.approx(dict.fromkeys(drift["change"]["quantiles"], 2.0)),
        "largest": 2.0,
    }
    assert drift["law"]["count"] == 2
    assert b"all perturbed" in keyless.page(found, None)
