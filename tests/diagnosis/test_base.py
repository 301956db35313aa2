"""The base's fit: of bodies that look alike the softest, and no end where one that it tries is torn apart."""

import numpy as np
import pytest
from planted import GRID, recording

from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis import base as fitting
from surgisim.diagnosis.base import START, TERMS
from surgisim.diagnosis.clip import clip_of
from surgisim.diagnosis.diagnose import prepare_case
from surgisim.diagnosis.memo import Memo
from surgisim.mpm.simulator import Breakdown


def test_ever_stiffer_bodies_are_tried_until_one_stands(monkeypatch):
    tried = []

    def only_stiff(prepared, clip, x, memo, frames):
        tried.append(float(np.exp(x[0])))
        if tried[-1] < 2e4:
            raise Breakdown("torn apart")
        return "drive", "run"

    monkeypatch.setattr(fitting, "simulate", only_stiff)
    clip = clip_of(recording(), share=GRID)
    x, made = fitting._standing(clip.prepared(TERMS), clip, START, Memo(None, ""), 4)
    assert made == ("drive", "run")
    assert tried == pytest.approx([3e3, 9e3, 2.7e4])
    assert np.exp(x[0]) == pytest.approx(2.7e4)
    monkeypatch.setattr(fitting, "simulate", lambda *_: (_ for _ in ()).throw(Breakdown("torn apart")))
    with pytest.raises(Breakdown):
        fitting._standing(clip.prepared(TERMS), clip, START, Memo(None, ""), 4)


def test_tissue_that_creeps_back_is_taken_for_the_softest_that_would(monkeypatch):
    creeps = np.array([np.log(8e3), 0.44, np.log(1.2e-2)])
    clip = clip_of(recording(values=fitting.values_of(creeps)), share=GRID)
    case = prepare_case(clip, Diagnosing(grid=GRID, nulls=8), Memo(None, ""), lambda *_: None)
    monkeypatch.setattr(fitting, "SOFTER", np.inf)
    other = prepare_case(clip, Diagnosing(grid=GRID, nulls=8), Memo(None, ""), lambda *_: None)
    assert np.exp(case.base.x[0]) < 0.7 * np.exp(other.base.x[0])
    costs = [float(case.space.gram(c.z[:, None], c.z[:, None])[0, 0]) for c in (case, other)]
    assert costs[0] - costs[1] < fitting.ALIKE


def test_a_base_is_fitted_anew_where_a_run_fits_worse_than_promised(monkeypatch):
    def runs() -> int:
        said = []
        clip = clip_of(recording(), share=GRID)
        prepare_case(clip, Diagnosing(grid=GRID, nulls=8), Memo(None, ""), lambda *told: said.append(told[-1]))
        return sum("base, run" in text for text in said)

    assert runs() == 2
    monkeypatch.setattr(fitting, "AGAIN", -np.inf)
    assert runs() == fitting.ROUNDS + 1
