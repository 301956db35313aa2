"""Drawn recordings: what they are, and how their evidence is held against the nulls."""

from types import SimpleNamespace

import numpy as np
import pytest
from made_up import recording

from surgisim.diagnosis.noise import Noise
from surgisim.problem import Problem
from surgisim.proof.self_consistency import consistency, draws, noise_alone, recorded
from surgisim.report.board.self_consistency import picture

BODY = recording()


def made_up_case(kept: np.ndarray) -> SimpleNamespace:
    """As much of a case as drawing needs: every point at rest in the base."""
    rest = BODY.attached()[kept]
    noise = Noise(np.full(len(kept), 3e-4), 0.2, 0.006, 0.02, 0.02, 0.7, 0.5, 0.3, 0.75, 0.45)
    clip = SimpleNamespace(rest=rest, frames=BODY.frames)
    return SimpleNamespace(
        clip=clip, noise=noise, base=SimpleNamespace(simulated=np.zeros((len(kept), BODY.frames, 3)))
    )


def said(evidence: float, nulls: np.ndarray) -> dict:
    return {"verdict": "nothing detectable", "global_test": {"log_evidence": evidence, "nulls": nulls.tolist()}}


def test_draws_differ_come_again_and_become_recordings_that_can_be_read(tmp_path):
    kept = np.arange(0, 12, 2)
    case = made_up_case(kept)
    moved = draws(case, 3, 7, noise_alone)
    assert (moved == draws(case, 3, 7, noise_alone)).all()
    assert not (moved[0] == moved[1]).any()
    assert moved.std() == pytest.approx(case.noise.sigma, rel=0.2)
    made = recorded(BODY, kept, case.clip.rest, moved[1], 1)
    assert made.name == f"{BODY.name}-1"
    assert (made.visible == BODY.visible[kept]).all()
    assert made.points[made.visible] == pytest.approx((case.clip.rest[:, None] + moved[1])[made.visible], abs=1e-7)
    with pytest.raises(Problem, match="finite displacements"):
        draws(case, 1, 7, lambda case, rng: np.zeros((2, 2, 3)))


def test_evidence_that_is_one_more_null_is_found_consistent_and_larger_is_not():
    rng = np.random.default_rng(2)
    nulls = rng.gumbel(size=(200, 24))
    fine = consistency([said(e, n) for e, n in zip(rng.gumbel(size=200), nulls, strict=True)])
    assert fine["ks"]["p"] > 0.05
    assert fine["beyond"]["0.1"]["low"] < 0.1 < fine["beyond"]["0.1"]["high"]
    large = consistency([said(e + 1, n) for e, n in zip(rng.gumbel(size=200), nulls, strict=True)])
    assert large["ks"]["p"] < 1e-4
    assert large["beyond"]["0.1"]["low"] > 0.1
    assert picture(large).startswith(b"\x89PNG")


def test_ties_lie_anywhere_among_their_equals():
    found = consistency([said(0.0, np.zeros(24)) for _ in range(300)])
    assert found["ks"]["p"] > 0.01
