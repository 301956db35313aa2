"""The base's fit does not end where one of the bodies it tries is torn apart."""

import numpy as np
import pytest
from planted import GRID, recording

from surgisim.diagnosis import base as fitting
from surgisim.diagnosis.base import START, TERMS
from surgisim.diagnosis.clip import clip_of
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
