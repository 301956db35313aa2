"""Promises that every candidate law keeps; a new file in candidates/ is tested unasked."""

import ast
import string
from pathlib import Path

import numpy as np
import pytest
from planted import plain

from surgisim import diagnosis
from surgisim.diagnosis import words
from surgisim.diagnosis.base import TERMS, carried, values_of
from surgisim.diagnosis.candidates import blocks, catalogue, costly
from surgisim.diagnosis.knobs import turned
from surgisim.diagnosis.laws import described, law_of, steps
from surgisim.physics.catalogue import catalogue as terms

LAWS = catalogue()
every_law = pytest.mark.parametrize("name", LAWS)
WHOLE_OR_PART = (
    "stiffening", "fibre", "pretension", "relaxation", "plastic_set", "damage", "active_contraction",
)  # fmt: skip
"""Laws of stress, which may act everywhere, in a layer and in a blob."""
STRONG = {
    "relaxation": 600.0, "plastic_set": 0.3, "damage": 3.0, "pretension": 200.0, "active_contraction": 300.0,
    "stiffening": 4e3, "fibre": 1.5e3,
}  # fmt: skip
"""Strengths at which a law shows; elsewhere a tenth of a newton, of a metre a second squared, or of a share."""
SPOT = np.array([0.0, 0.0, 0.010])
"""Beside the grip [m]: farther away tissue is hardly strained."""


@pytest.fixture(scope="module")
def case():
    return plain()


@pytest.fixture(scope="module")
def tried(case):
    """Law -> scope -> (block, hypothesis) of the form that shows most."""
    found: dict[str, dict[str, tuple]] = {}
    largest: dict[tuple[str, str], float] = {}
    cheap = blocks(case.clip, case.base, case.memo, SPOT)
    for _, make in [*cheap, *costly(case.clip, case.base, case.memo, 1)]:
        for block in make():
            assert np.isfinite(block.written_out).all()
            for h in block.hypotheses:
                assert h.mix.shape[0] == len(block.columns)
                assert np.isfinite(h.mix).all()
                size = float(np.linalg.norm(signature(block, h)))
                if size > largest.get((h.term, h.scope), 0.0):
                    largest[h.term, h.scope] = size
                    found.setdefault(h.term, {})[h.scope] = (block, h)
    return found


def strength(h) -> np.ndarray:
    return np.full(h.mix.shape[1], STRONG.get(h.term, 0.1))


def signature(block, h) -> np.ndarray:
    return np.tensordot(h.mix @ strength(h), block.written_out, (0, 0))


@pytest.mark.slow
@every_law
def test_a_law_is_tried_and_says_what_the_engine_runs(case, tried, name):
    for scope, (_, h) in tried[name].items():
        law = law_of(h, strength(h), case.clip)
        assert set(law.values) <= set(terms())
        assert law.values or law.motion is not None
        assert set(law.places) <= set(law.values)
        assert (h.place is None) == (scope == "everywhere")
        for term, numbers in law.values.items():
            assert set(numbers) == set(terms()[term].params)
            assert np.isfinite(list(numbers.values())).all()
        if law.values:
            prepared = case.clip.prepared((*TERMS, *law.values))
            assert np.isfinite(prepared.theta({**values_of(case.base.x), **law.values}, law.places)).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", WHOLE_OR_PART)
def test_laws_of_stress_are_tried_everywhere_in_layers_and_in_blobs(tried, name):
    assert set(tried[name]) == {"everywhere", "layer", "blob"}


@pytest.mark.slow
@pytest.mark.parametrize("name", WHOLE_OR_PART)
def test_in_a_blob_the_engine_does_what_the_signature_says(case, tried, name):
    (block, h), clip = tried[name]["blob"], case.clip
    much, little = (law_of(h, share * strength(h), clip) for share in (1.0, 1e-6))
    # What pulls by itself does so before the first frame in the engine, and sets in after it in the search.
    late = clip.time[: clip.until] > 0.3
    there, said = difference(case, much, little)[:, late], signature(block, h)[:, late]
    assert np.sum(there * said) > 0.9 * np.sqrt(np.sum(there**2) * np.sum(said**2))
    away, size = np.linalg.norm(clip.rest - h.place.center, axis=1), np.sqrt((there**2).sum(-1).mean(-1))
    assert size[away > 4 * h.place.extent].mean() < 0.6 * size[away < 2.5 * h.place.extent].mean()


def difference(case, much, little) -> np.ndarray:
    """Between two strengths of a law in the engine [m], (K, T, 3), with the same step and the same anchors.

    What a shorter step changes is as large as a blob's effect; and anchors follow the modulus of a law that stores
    energy as if it acted everywhere (mpm/setup.py).
    """
    clip = case.clip
    prepared = clip.prepared((*TERMS, *much.values))
    strong, weak = ({**values_of(case.base.x), **law.values} for law in (much, little))
    per_frame = steps(clip, prepared, prepared.theta(strong, much.places))
    drive = prepared.drive(clip.motion, weak, fps=clip.fps, per_frame=per_frame, places=little.places)
    runs = [
        prepared.simulator.run(prepared.theta(values, much.places), drive, last=clip.until - 1)
        for values in (strong, weak)
    ]
    first, second = (carried(prepared.simulator.carry(clip.rest), run) for run in runs)
    return first - second


@pytest.mark.slow
@every_law
def test_two_sentences_can_be_said(case, tried, name):
    law = LAWS[name]
    assert {f for _, f, *_ in string.Formatter().parse(law.seen) if f} <= {"where", "onset", "end", "less"}
    assert {f for _, f, *_ in string.Formatter().parse(law.added) if f} == {"amount"}
    for _, h in tried[name].values():
        number = {"value": 1.0, "low": 0.5, "high": 2.0, "unit": "Pa"}
        said = words.sentence([(h, {"k": number}, 1e-3)], 0.9)
        assert "  " not in said
        assert said.count(". ") == 1


@pytest.mark.slow
@every_law
def test_numbers_have_intervals_that_hold_them(case, tried, name):
    for _, h in tried[name].values():
        amplitude = strength(h)
        numbers = described(h, amplitude, 0.1 * amplitude, case.clip, case.base)
        assert numbers
        assert all(n["low"] <= n["value"] <= n["high"] for n in numbers.values())
        assert any(n["low"] < n["value"] < n["high"] for n in numbers.values())


@pytest.mark.slow
@every_law
def test_a_knob_that_is_not_turned_changes_nothing_and_one_that_is_does(case, tried, name):
    for scope, (_, h) in tried[name].items():
        amplitude = strength(h)
        knobs = LAWS[name].knobs(h, amplitude)
        same, as_strong = turned(h, amplitude, knobs, np.zeros(len(knobs)), case.clip)
        plain = law_of(h, amplitude, case.clip)
        assert numbers_of(law_of(same, as_strong, case.clip)) == pytest.approx(numbers_of(plain), rel=1e-12)
        if scope in ("blob", "patch"):
            assert len(knobs) >= 5, "a blob's centre and extent are free"
        for e in np.eye(len(knobs)):
            # One way or the other: a number may stand at an end of its range.
            sides = [law_of(*turned(h, amplitude, knobs, by * e, case.clip), case.clip) for by in (-0.3, 0.3)]
            assert any(numbers_of(side) != pytest.approx(numbers_of(plain), rel=1e-9) for side in sides)


def numbers_of(law) -> list[float]:
    found = [v for numbers in law.values.values() for v in numbers.values()]
    for place in law.places.values():
        found += [*map(float, place.center), place.extent]
    return found if law.motion is None else [*found, *law.motion.position.ravel()]


@every_law
def test_a_laws_name_stands_in_its_own_file_only(name):
    room = Path(diagnosis.__file__).parent
    for path in room.rglob("*.py"):
        said = {n.value for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.Constant)}
        if name in said and path.name != f"{name}.py":
            # Laws may need another's term in the engine.
            assert name in terms(), f"{path.name} names {name}"
            assert path.parent.name == "candidates" or path.name == "inclusion.py", f"{path.name} names {name}"
