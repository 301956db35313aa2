"""Frames held out refute, confirm, or cannot show; what they refute gives way to the next law that they confirm."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from surgisim.diagnosis import judgement
from surgisim.diagnosis.calibration import BORNE_OUT, CERTAIN, CLEAR, PULLS, PUSH_LEAVES, THRESHOLD, TRIED
from surgisim.diagnosis.evidence import Finding
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.joint import Joint
from surgisim.diagnosis.judgement import Explanation, stands
from surgisim.diagnosis.prospect import Gain
from surgisim.diagnosis.refit import Refit
from surgisim.physics.place import Place

BETTER, WORSE, ALIKE, BLIND = (
    Gain(60.0, 30.0, 90.0, 70.0), Gain(-60.0, -90.0, -30.0, 70.0), Gain(5.0, -20.0, 30.0, 70.0), Gain(0.1, -1, 1, 2.0)
)  # fmt: skip
CASE, UNCALIBRATED = (
    SimpleNamespace(
        settings=SimpleNamespace(calibrated=known),
        overstretched=False,
        clip=SimpleNamespace(recording=SimpleNamespace(guessed=False), held=np.ones(4, bool), until=3),
    )
    for known in (True, False)
)


def explanation(term="gravity", evidence=90.0, ahead=BETTER, left=0.05, out=None) -> Explanation:
    place = Place((0.0, 0.0, 0.0), 0.003) if term == "hidden_contact" else None
    finding = Finding(
        Hypothesis(term, np.eye(3), 0, place), evidence, np.ones(3), np.ones(3), 100.0, np.zeros(1), 0, 1e-4
    )
    one = Refit(finding, np.ones(3), np.zeros((1, 1, 3)), 100.0, evidence)
    return Explanation(Joint([one], np.zeros((1, 1, 3)), 100.0, np.zeros(3)), evidence, ahead, left, out)


def reason(chosen: Explanation, held=0.9, explained=0.9, borne=0.9, unfit=False, over=None, case=CASE) -> str:
    return judgement._reason(case, chosen, held, explained, borne, unfit, over)


def test_what_frames_held_out_refute_gives_way_to_the_next_that_they_confirm():
    refuted, blind, confirmed = (explanation(ahead=ahead) for ahead in (WORSE, BLIND, BETTER))
    assert stands([refuted, blind, confirmed]) is confirmed
    assert stands([refuted, blind]) is refuted
    assert stands([blind, confirmed]) is blind
    weak = explanation(evidence=THRESHOLD - 1 - 0.5 * BETTER.value)
    assert stands([refuted, weak]) is refuted


def test_a_plain_error_that_falls_confirms_where_the_likelihood_agrees():
    unsure, against, unseen = (replace(explanation(ahead=a), falls=True) for a in (ALIKE, WORSE, BLIND))
    assert reason(unsure) == "named"
    assert reason(against) == "refuted"
    assert not unseen.confirmed


def test_what_they_gain_or_lose_counts_among_the_evidence():
    assert explanation(ahead=BETTER).support == 90.0 + 30.0
    assert explanation(ahead=WORSE).support == 90.0 - 30.0
    assert explanation(ahead=None).support == 90.0


@pytest.mark.parametrize(
    ("chosen", "said"),
    [
        (explanation(), "named"),
        (explanation(ahead=WORSE), "refuted"),
        (explanation(ahead=ALIKE), "unconfirmed"),
        (explanation(ahead=BLIND), "named"),
        (explanation(ahead=None), "named"),
        (explanation(evidence=THRESHOLD - 1), "named"),
        (explanation(evidence=THRESHOLD - 1 - 0.5 * BETTER.value), "faint"),
        (explanation(evidence=THRESHOLD - 1, ahead=None), "faint"),
        (explanation(ahead=WORSE, evidence=CLEAR - 1), "faint"),
        (explanation(ahead=WORSE, evidence=CLEAR + 1), "refuted"),
        (explanation("hidden_contact", left=PUSH_LEAVES + 0.1, out=-0.8), "loose"),
        (explanation("hidden_contact", out=PULLS + 0.1), "drawn"),
        (explanation("hidden_contact", out=-0.8), "named"),
    ],
)
def test_a_law_is_named_for_a_reason(chosen, said):
    assert reason(chosen) == said


@pytest.mark.parametrize("ahead", [BLIND, None])
def test_what_nothing_confirms_and_the_fitted_frames_do_not_settle_is_supported_only(ahead):
    faint = explanation(ahead=ahead, evidence=CLEAR - 1)
    assert reason(faint, held=0.6) == "unconfirmed"
    assert reason(faint, held=0.9) == "named"
    assert reason(explanation(ahead=ahead, evidence=CLEAR + 1), held=0.6) == "named"


def test_frames_held_out_may_confirm_more_than_a_law_promised():
    more, noise = Gain(35.0, 22.0, 48.0, 7.0), Gain(12.0, 2.0, 22.0, 7.0)
    for ahead, said in ((more, "named"), (noise, "unconfirmed")):
        faint = explanation(ahead=ahead, evidence=CLEAR - 1)
        assert not faint.visible
        assert reason(faint, held=0.6) == said


@pytest.mark.parametrize(
    ("chances", "others"),
    [
        ({"damage": 0.93, "fibre": 0.06}, []),
        ({"damage": 0.7, "fibre": 0.28}, ["fibre"]),
        ({"damage": 0.85, "fibre": 0.08}, []),
        ({"damage": 0.5, "fibre": 0.2, "tether": 0.25}, ["tether", "fibre"]),
        ({"damage": 0.62, "fibre": 0.3, "tether": 0.08}, ["fibre"]),
        ({"damage": 0.4, "stiffening": 0.3, "tether": 0.3}, ["tether"]),
    ],
)
def test_a_class_holds_nine_tenths_of_the_probability_as_far_as_nothing_speaks_against_its_laws(chances, others):
    tried = [explanation(term, ahead=WORSE if term == "stiffening" else BETTER) for term in chances]
    assert [r.term for r in judgement.instead(tried[0], tried, chances)] == others


def test_two_laws_named_together_are_no_class():
    pair, other = explanation("damage"), explanation("fibre")
    pair.fitted.refits.append(explanation("tether").first)
    assert judgement.instead(pair, [pair, other], {"damage": 0.6, "fibre": 0.4}) == ()


@pytest.mark.parametrize(
    ("evidence", "overstretched", "said"),
    [(CLEAR - 1, False, "faint"), (CLEAR + 1, False, "little"), (THRESHOLD - 1, True, "little")],
)
def test_what_explains_little_says_that_something_is_hidden_only_where_that_is_certain(evidence, overstretched, said):
    case = SimpleNamespace(settings=CASE.settings, overstretched=overstretched)
    assert reason(explanation(evidence=evidence, ahead=ALIKE), explained=0.3, case=case) == said


@pytest.mark.parametrize(
    ("evidence", "ahead", "borne", "said"),
    [
        (CLEAR + 1, BETTER, 2 * BORNE_OUT, "named"),
        (CLEAR - 1, BETTER, 2 * BORNE_OUT, "named"),
        (CLEAR + 1, BETTER, 0.5 * BORNE_OUT, "unbacked"),
        (CLEAR + 1, ALIKE, 2 * BORNE_OUT, "little"),
        (CLEAR - 1, ALIKE, 2 * BORNE_OUT, "faint"),
    ],
)
def test_what_frames_held_out_confirm_need_not_explain_all_that_a_smooth_field_does(evidence, ahead, borne, said):
    assert reason(explanation(evidence=evidence, ahead=ahead), explained=0.3, borne=borne) == said


def test_a_plain_error_that_rises_refutes():
    rising, confirmed = replace(explanation(), rises=True), explanation()
    assert reason(rising) == "refuted"
    assert stands([rising, confirmed]) is confirmed


def two(more: int, chance: float, cos: float) -> tuple[Explanation, list[Explanation], dict[str, float]]:
    freer = explanation("hidden_contact")
    h = freer.first.finding.hypothesis
    same = Hypothesis("added_mass", np.eye(3)[:, :more], 1, h.place)
    finding = Finding(same, 90.0, np.ones(more), np.ones(more), 100.0, np.zeros(1), 0, 1e-4)
    one = Refit(finding, np.ones(more), np.zeros((1, 1, 3)), 100.0, 90.0)
    fewer = Explanation(Joint([one], np.zeros((1, 1, 3)), 100.0, np.zeros(3)), 90.0, BETTER, 0.05, None)
    return freer, [freer, fewer], {"hidden_contact": 1 - chance, "added_mass": chance}


CASES = [
    (1, 0.35, 0.95, False, True),
    (1, 0.1, 0.95, False, False),
    (1, 0.35, 0.5, False, False),
    (3, 0.35, 0.95, False, False),
    # A guessed body answers either somewhat otherwise.
    (1, 0.35, 0.8, False, False),
    (1, 0.35, 0.8, True, True),
]


@pytest.mark.parametrize(("more", "chance", "cos", "guessed", "simpler"), CASES)
def test_of_two_laws_that_do_the_same_the_simpler_comes_first(monkeypatch, more, chance, cos, guessed, simpler):
    monkeypatch.setattr(judgement, "cos", lambda *_: cos)
    monkeypatch.setattr(judgement, "guessed", lambda _: guessed)
    freer, tried, chances = two(more, chance, cos)
    assert judgement.simplest(CASE, freer, tried, chances) is tried[int(simpler)]


def test_a_law_is_not_named_for_little():
    assert reason(explanation(ahead=ALIKE), explained=0.5) == "little"
    assert reason(explanation(evidence=CLEAR - 1), borne=0.5 * BORNE_OUT) == "faint"
    assert reason(explanation(evidence=CLEAR + 1), borne=0.5 * BORNE_OUT) == "unbacked"
    assert reason(explanation(evidence=CLEAR - 1), borne=0.5 * BORNE_OUT, case=UNCALIBRATED) == "named"


def test_where_the_fitted_frames_leave_no_doubt_something_is_hidden_though_all_else_speaks_against_the_law():
    much_worse = Gain(-4 * CERTAIN, -5 * CERTAIN, -3 * CERTAIN, 50.0)
    said = {e: reason(explanation(evidence=e, ahead=much_worse), borne=0.0) for e in (CERTAIN - 1, CERTAIN)}
    assert said == {CERTAIN - 1: "faint", CERTAIN: "refuted"}


def test_a_law_beyond_doubt_that_foretells_as_much_as_it_promises_need_not_be_borne_out_so_far():
    def said(borne: float, **changed) -> str:
        return reason(explanation(**{"evidence": CERTAIN, "ahead": BETTER} | changed), borne=borne)

    assert said(0.5 * BORNE_OUT) == "named"
    assert said(-0.1) == "unbacked"
    assert said(0.5 * BORNE_OUT, evidence=CERTAIN - 1) == "unbacked"
    assert said(0.5 * BORNE_OUT, ahead=replace(BETTER, expected=3 * BETTER.value)) == "unbacked"
    assert said(0.5 * BORNE_OUT, ahead=BLIND) == "unbacked"


def test_a_law_beyond_doubt_is_named_where_little_that_it_promises_comes():
    def said(ahead: Gain, evidence: float = CERTAIN) -> str:
        return reason(explanation(evidence=evidence, ahead=ahead))

    kept, missed = Gain(31.0, -4.0, 70.0, 32.0), Gain(12.0, -23.0, 51.0, 32.0)
    assert said(kept) == "named"
    assert said(kept, CERTAIN - 1) == "unconfirmed"
    assert said(missed) == "unconfirmed"


def test_what_only_frames_held_out_speak_for_is_not_named():
    much = Gain(60.0, 2.0, 110.0, 60.0)
    assert reason(explanation(evidence=TRIED - 1, ahead=much)) == "faint"
    assert reason(explanation(evidence=TRIED + 1, ahead=much)) == "named"


def test_what_leaves_frames_held_out_far_off_is_not_named():
    assert reason(explanation(evidence=CLEAR + 1), unfit=True) == "unfit"
    assert reason(explanation(evidence=CLEAR - 1), unfit=True) == "faint"
    assert reason(explanation(evidence=CLEAR + 1, ahead=WORSE), unfit=True) == "refuted"


def test_what_takes_nothing_off_and_frames_held_out_contradict_is_nothing_however_the_fitted_ones_speak():
    for ahead, said in ((WORSE, "faint"), (BLIND, "loose"), (None, "loose")):
        push = explanation("hidden_contact", evidence=CLEAR + 1, ahead=ahead, left=PUSH_LEAVES + 0.1, out=-0.8)
        assert reason(push, borne=0.0) == said
    push = explanation("hidden_contact", evidence=CLEAR + 1, ahead=WORSE, left=PUSH_LEAVES + 0.1, out=-0.8)
    assert reason(push, borne=2 * BORNE_OUT) == "loose"


def test_a_tie_with_a_placebo_is_no_defeat():
    assert [reason(explanation(), over=over) for over in (None, BETTER, ALIKE, BLIND)] == ["named"] * 4
    assert reason(explanation(), over=WORSE) == "beaten"


@pytest.mark.parametrize(
    ("chosen", "ahead", "borne", "later", "said"),
    [
        (explanation(left=0.3), True, 0.9, 0.9, "named"),
        # A guessed body is off by more than noise: what explains little of that says nothing, however sure it looks.
        (explanation(left=0.6), True, 0.9, 0.9, "faint"),
        # Single tracks go astray in ways of their own, and a push follows them.
        (replace(explanation(left=0.0), smooth=0.1), True, 0.9, 0.9, "faint"),
        (explanation(evidence=CLEAR - 1), True, 0.9, 0.9, "faint"),
        # Frames held out speak for it where they can, before what the fitted ones bear out.
        (explanation(left=0.3), True, -1.0, 0.9, "named"),
        (explanation(left=0.3), True, 0.9, 0.3, "unfit"),
        (explanation(left=0.3), True, 0.9, None, "named"),
        # Nothing is said where neither does.
        (explanation(left=0.3), True, -1.0, None, "faint"),
        (explanation(left=0.3), False, 0.9, 0.9, "unconfirmed"),
        (explanation(left=0.3, ahead=WORSE), True, 0.9, 0.9, "refuted"),
        # A push may leave what any law of a video may.
        (explanation("hidden_contact", left=0.3, out=-0.8), True, 0.9, 0.9, "named"),
        (explanation("hidden_contact", left=0.3, out=0.8), True, 0.9, 0.9, "drawn"),
    ],
)
def test_a_law_that_a_video_shows_takes_most_of_the_misfit(chosen, ahead, borne, later, said):
    assert judgement._reason_guessed(CASE, chosen, ahead, borne, later, None) == said


def test_a_video_in_which_nothing_is_seen_to_pull_names_nothing():
    late = SimpleNamespace(**vars(CASE.clip) | {"held": np.arange(4) == 3})
    case = SimpleNamespace(**vars(CASE) | {"clip": late})
    assert judgement._reason_guessed(case, explanation(left=0.3), True, 0.9, 0.9, None) == "ungrasped"
