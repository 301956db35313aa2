"""A contraction that travels, and one that was under way when the recording began."""

import numpy as np
import pytest

from surgisim.physics.catalogue import choose, defaults
from surgisim.physics.place import rows
from surgisim.physics.terms.active_contraction import TERM

AT_WORK = defaults(TERM)


def test_a_wave_reaches_the_far_end_later_by_its_slowness():
    rest = np.array([[-0.01, 0.0, 0.06], [0.02, 0.0, 0.06], [0.02, 0.03, 0.08]])
    values = AT_WORK | {"slowness": 5.0}
    onset = rows(choose(["active_contraction"]), {"active_contraction": values}, {}, rest, np.ones(3))[:, 1]
    assert onset[1] - onset[0] == pytest.approx(5.0 * 0.03)
    assert onset[2] == pytest.approx(onset[1])
    assert onset.mean() == pytest.approx(values["onset"])


def test_a_rhythm_under_way_begins_at_rest_and_then_lets_go():
    row = TERM.row(AT_WORK | {"onset": -1.0})
    still = (np.eye(3), np.zeros((3, 3)), np.zeros(0))
    assert np.allclose(TERM.cauchy(*still, 0.0, row), 0)
    assert TERM.cauchy(*still, 0.9, row)[0, 0] < 0
