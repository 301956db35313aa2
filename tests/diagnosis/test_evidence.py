"""Evidence prefers what is there, and charges for having looked in many places."""

from dataclasses import replace

import numpy as np
import pytest

from surgisim.diagnosis.evidence import SIZES, by_law, judge, weigh
from surgisim.diagnosis.form import Block
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.metric import metric
from surgisim.diagnosis.noise import Noise, whitener
from surgisim.diagnosis.sight import Products, Sight

SPACE = metric(np.zeros((400, 1)))


def found(signature, residual, term="here", sign=0):
    white = signature[:, None]
    gram, shadow = SPACE.gram(white, white), SPACE.gram(white, residual)
    return weigh([Hypothesis(term, np.ones((1, 1)), sign)], Products(np.array([[1e-8]]), gram, shadow), 0)[0]


@pytest.fixture
def parts():
    rng = np.random.default_rng(0)
    return rng, rng.standard_normal(400)


def test_a_planted_signature_is_found_and_nulls_are_not(parts):
    rng, s = parts
    residuals = np.concatenate([(0.6 * s)[:, None], np.zeros((400, 1))], 1) + rng.standard_normal((400, 2))
    f = found(s, residuals)
    assert f.log_evidence > 20 > 1 > f.nulls[0]
    assert f.amplitude[0] == pytest.approx(0.6, abs=0.2)


def test_an_amplitude_of_the_wrong_sign_counts_against_a_law(parts):
    rng, s = parts
    residual = (-0.6 * s + rng.standard_normal(400))[:, None]
    assert found(s, residual).log_evidence > 20
    assert found(s, residual, sign=1).log_evidence < 1


def test_a_law_tried_in_many_places_pays_for_them(parts):
    rng, s = parts
    residual = (0.6 * s + rng.standard_normal(400))[:, None]
    others = [found(rng.standard_normal(400), residual, "anywhere") for _ in range(50)]
    laws = by_law([found(s, residual), found(s, residual, "anywhere"), *others])
    assert laws["here"].evidence - laws["anywhere"].evidence == pytest.approx(np.log(51), abs=0.05)


def test_the_many_places_of_one_scope_do_not_dilute_another(parts):
    rng, s = parts
    residual = (0.6 * s + rng.standard_normal(400))[:, None]
    there = found(s, residual, "law")
    alone = by_law([there])["law"].evidence
    blobs = [found(rng.standard_normal(400), residual, "law") for _ in range(50)]
    blobs = [replace(b, hypothesis=replace(b.hypothesis, scope="blob")) for b in blobs]
    assert alone - by_law([there, *blobs])["law"].evidence == pytest.approx(np.log(2), abs=0.05)


def test_what_nuisances_take_all_but_wholly_is_weighed_without_rounding(parts):
    rng, _ = parts
    points, frames, noise = 40, 25, 5e-6
    seen = np.ones((points, frames), bool)
    white = whitener(
        Noise(np.full(points, noise), 0, 0.01, 0, 0, 0, 0, 0, 0, 1.0), rng.standard_normal((points, 3)), seen
    )
    open_too = rng.standard_normal((6, points, frames, 3)).astype(np.float32)
    space = metric(white(open_too).T)
    taken = np.einsum("cs,sktj->cktj", rng.standard_normal((4, 6)), open_too)
    sight = Sight(white, space, seen)
    left = sight.of(rng.standard_normal((points * frames * 3, 2)).astype(np.float32))
    block = Block(taken.astype(float), [Hypothesis("taken", np.eye(4), 0), Hypothesis("one", np.eye(4)[:, :1], 1)])
    exact = SIZES[-1] ** 2 * sight.products(block.columns, left).gram
    assert np.linalg.eigvalsh(exact)[0] > -1e-3
    with np.errstate(invalid="raise"):
        found = judge(block, sight, left, 0)
    for f in found:
        assert np.isfinite([f.log_evidence, *f.nulls, *f.spread]).all()
        assert (f.spread > 0).all()
