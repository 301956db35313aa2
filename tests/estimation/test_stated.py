"""What estimation states of default and fitted parameters, phase by phase."""

import numpy as np

from surgisim.estimation.observation import PHASES
from surgisim.estimation.stated import by_phase


def test_the_rest_is_in_no_number():
    phase = np.array([PHASES.index(n) for n in ("rest", "load", "hold", "release")])
    default = np.tile([9.0, 1.0, 2.0, 3.0], (10, 1))
    fitted = default * [1.0, 0.5, 0.5, 2.0]
    default[0], fitted[0] = np.nan, np.nan
    found = by_phase(default, fitted, phase)
    assert {span: entries["default"]["value"] for span, entries in found.items()} == {
        "load": 1.0, "hold": 2.0, "released": 3.0, "pull": 2.0,
    }  # fmt: skip
    assert found["released"]["share"]["value"] == 2.0
    assert found["load"]["fitted"]["count"] == 9


def test_a_phase_without_a_frame_is_left_out():
    assert by_phase(np.ones((6, 1)), np.ones((6, 1)), np.array([PHASES.index("rest")])) == {}
