"""A base that slides in a patch holds everywhere else."""

import numpy as np
import pytest

from surgisim.physics.catalogue import choose
from surgisim.physics.place import Place, rows

TERMS = choose(["sliding_base"])
VALUES = {"sliding_base": {"share": 1.0, "stiffness": 300.0, "cap": 0.03, "yaw": 0.0, "pitch": 0.0}}
REST = np.stack([np.linspace(0, 0.05, 11), np.zeros(11), np.zeros(11)], 1)
VOLUME, HELD = np.full(11, 2e-9), np.arange(11) < 9
NAMES = list(TERMS["sliding_base"].row(VALUES["sliding_base"]))


def columns(places):
    found = rows(TERMS, VALUES, places, REST, VOLUME, {"held": HELD})
    return dict(zip(NAMES, found.T, strict=True))


def test_springs_take_over_the_whole_bond_and_only_the_patch_slides():
    whole, patch = columns({}), columns({"sliding_base": Place((0.01, 0.0, 0.0), 0.004)})
    for name in ("share", "stiffness"):
        assert np.array_equal(patch[name], whole[name])
        assert (patch[name][~HELD] == 0).all()
    assert whole["cap"][HELD] * 2e-9 * 9 == pytest.approx(0.03)
    assert patch["cap"][2] == pytest.approx(whole["cap"][2])
    assert patch["cap"][6] > 100 * whole["cap"][6]
