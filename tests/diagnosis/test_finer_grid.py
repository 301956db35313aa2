"""What is shown comes from a finer grid, with the numbers of the search."""

from dataclasses import replace

import numpy as np
import pytest
from planted import GRID, recording

from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis.clip import clip_of
from surgisim.diagnosis.diagnose import prepare_case
from surgisim.diagnosis.evidence import Finding
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.laws import law_of, respond
from surgisim.diagnosis.memo import Memo
from surgisim.diagnosis.refit import Refit
from surgisim.diagnosis.replay import replayed
from surgisim.diagnosis.together import prediction

FINE, WEIGHT = 0.18, np.array([8.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    clip = clip_of(recording(values={"gravity": {"x": 8.0, "y": 0.0, "z": 0.0, "onset": -1.0}}), share=GRID)
    # One folder for both grids: a run of the one must not pass for a run of the other.
    memo = Memo(tmp_path_factory.mktemp("work"), "a recording")
    return prepare_case(clip, Diagnosing(grid=GRID, replay=FINE, nulls=8), memo, lambda *_: None)


@pytest.fixture(scope="module")
def named(case):
    h = Hypothesis("gravity", np.eye(3), 0, None, 0.0)
    moved = respond(case.clip, case.base, law_of(h, WEIGHT, case.clip), case.memo)
    change = moved - case.base.simulated
    finding = Finding(h, 50.0, WEIGHT, 0.1 * np.abs(WEIGHT), 100.0, np.zeros(1), 0, 1e-4)
    return prediction(case, [Refit(finding, WEIGHT, change, 1.0, 1.0)], moved, None)


def test_a_replay_is_the_engines_on_the_finer_grid(case, named):
    shown = replayed(case, named, named)
    fine = clip_of(case.clip.recording, share=FINE)
    law = law_of(named.refits[0].finding.hypothesis, WEIGHT, fine)
    assert shown.clip.body.spacing == fine.body.spacing < case.clip.body.spacing
    assert np.array_equal(shown.clip.rest, case.clip.rest)
    assert shown.after == pytest.approx(respond(fine, case.base, law, Memo(None, "")), abs=1e-7)
    assert shown.placebo == pytest.approx(shown.after)
    assert np.abs(shown.before - case.base.simulated).max() > 1e-5
    # An error of the grid, not of the law: what the law adds is nearly the same.
    added = [after - before for after, before in ((shown.after, shown.before), (named.moved, case.base.simulated))]
    assert np.sum(added[0] * added[1]) > 0.98 * np.sqrt(np.sum(added[0] ** 2) * np.sum(added[1] ** 2))


def test_no_replay_on_a_grid_that_is_not_finer(case, named):
    assert replayed(replace(case, settings=Diagnosing(grid=GRID, replay=GRID)), named, None) is None
