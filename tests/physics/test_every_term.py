"""Promises that every law keeps; a new file in physics/terms/ is tested unasked."""

import laws
import numpy as np
import pytest
from laws import TERMS

from surgisim.physics.catalogue import Param

every_term = pytest.mark.parametrize("name", TERMS)
precisions = pytest.mark.parametrize("precision", ["double", "single"])

ROUNDING = {"double": 1e-12, "single": 2e-5}
"""Device against twin, relative to the largest value of any state."""
SLOPE = {"double": 1e-5, "single": 1e-2}
"""Adjoint against central differences, relative."""
FLOOR = {"double": 1e-8, "single": 1e-4}
"""The same, relative to the largest slope of any state: what differences of zero leave."""


def on_particles(name):
    term = TERMS[name]
    if not laws.on_particles(term):
        pytest.skip(f"{name} enters as {term.enters}: no particle's response changes, and its own tests judge it")
    return term


def with_stress(name):
    """The law, and whatever it rests upon, if it makes or changes a stress."""
    term = TERMS[name]
    if term.stress is None and not laws.needs_base(term):
        pytest.skip(f"{name} enters as {term.enters}: it makes no stress")
    return term


def anywhere(seed=0, size=0.25):
    rng = np.random.default_rng(seed)
    F = np.eye(3) + size * rng.uniform(-1, 1, (3, 3))
    return F, laws.stretching(F, rng.uniform(-1, 1, (3, 3)))


@every_term
def test_a_law_can_be_switched_off_and_starts_inside_its_range(name):
    params: dict[str, Param] = TERMS[name].params
    assert any(p.off is not None for p in params.values()), f"{name} cannot be switched off"
    for p in params.values():
        assert p.low <= p.default <= p.high or p.default == p.off
        assert p.low > 0 or not p.logarithmic


@every_term
@precisions
def test_the_device_says_what_the_readable_twin_says(name, precision):
    term = on_particles(name)
    found = laws.device(name, precision)
    wanted = [laws.response(term, s, s.row) for s in laws.states(name)]
    for k, part in enumerate(("P", "f", "after")):
        mine = np.array([getattr(d, part) for d in found])
        twins = np.array([np.broadcast_to(w[k], (3,) if part == "f" else np.shape(w[k])).ravel() for w in wanted])
        largest = np.abs(twins).max(initial=0.0)
        assert np.allclose(mine, twins, rtol=0, atol=ROUNDING[precision] * largest), part


@every_term
def test_a_law_does_something(name):
    term = on_particles(name)
    here = [s for s in laws.states(name) if s.kind == "loaded"]
    off = {n: v for n, v in term.row(laws.silent(term)).items()}
    quiet = [laws.response(term, laws.SimpleNamespace(**vars(s) | {"q": 0 * s.q}), off) for s in here]
    loud = [laws.response(term, s, s.row) for s in here]
    assert any(not np.allclose(a[k], b[k]) for a, b in zip(loud, quiet, strict=True) for k in (0, 1))


@every_term
def test_tissue_at_rest_is_free_of_stress_and_force_in_the_first_frame(name):
    term = on_particles(name)
    if not term.rests:
        pytest.skip(f"{name} says that it does not rest")
    row, zero, fresh = term.row(laws.typical(term)), np.zeros(3), np.zeros(term.memory)
    q = laws.remember(term, np.eye(3), np.zeros((3, 3)), zero, fresh, laws.DT, row)
    assert np.allclose(laws.cauchy(term, np.eye(3), np.zeros((3, 3)), q, 0.0, row), 0)
    if term.force is not None:
        assert np.allclose(term.twin(zero, zero, q, 1050.0, 0.0, **row), 0)


@every_term
def test_what_holds_the_first_frame_balances_a_stress_at_rest(name):
    if not TERMS[name].balanced:
        pytest.skip(f"{name} has nothing to balance")
    rest = [d for d, s in zip(laws.device(name, "double"), laws.states(name), strict=True) if s.place == "rest"]
    assert np.allclose([d.P for d in rest], 0)


@every_term
def test_stress_is_symmetric(name):
    term = with_stress(name)
    for s in laws.states(name):
        stress = laws.cauchy(term, s.F, laws.stretching(s.F, s.Fdot), s.q, s.t, s.row)
        assert np.allclose(stress, stress.T, atol=1e-9 * np.abs(stress).max())


@every_term
def test_turning_the_tissue_turns_the_stress(name):
    """Also where the tissue turned while it was loaded, for what laws remember has to turn along."""
    term, (past, _), (F, D) = with_stress(name), anywhere(1), anywhere(2)
    values, Q = laws.typical(term), laws.spun(1.0)
    row = term.row(values)
    plain = laws.cauchy(term, F, D, laws.loaded(term, values, past), 1.0, row)
    turned = laws.cauchy(term, Q @ F, Q @ D @ Q.T, laws.loaded(term, values, past, turning=True), 1.0, row)
    assert np.allclose(turned, Q @ plain @ Q.T, atol=1e-9 * np.abs(plain).max())


@every_term
def test_stress_is_the_slope_of_its_energy(name):
    term, (F, _) = TERMS[name], anywhere()
    if term.energy is None:
        pytest.skip(f"{name} stores no energy")
    row, h = term.row(laws.typical(term)), 1e-6
    slope = np.zeros((3, 3))
    for i, j in np.ndindex(3, 3):
        step = np.zeros((3, 3))
        step[i, j] = h
        slope[i, j] = (term.energy(F + step, **row) - term.energy(F - step, **row)) / (2 * h)
    cauchy = slope @ F.T / np.linalg.det(F)
    found = term.cauchy(F, np.zeros((3, 3)), np.zeros(term.memory), 1.0, row)
    assert np.allclose(found, cauchy, rtol=1e-6, atol=1e-5 * np.abs(cauchy).max())


@every_term
def test_resisting_a_rate_takes_power_out(name):
    """Stress beyond the elastic part: (sigma(F, D) - sigma(F, 0)) : D >= 0."""
    term = with_stress(name)
    for seed in range(10):
        F, D = anywhere(seed)
        row, q = term.row(laws.typical(term)), np.zeros(term.memory)
        lost = laws.cauchy(term, F, D, q, 1.0, row) - laws.cauchy(term, F, 0 * D, q, 1.0, row)
        assert (lost * D).sum() >= 0


@every_term
@pytest.mark.parametrize("seconds", [0.1, 1.0, 10.0])
def test_no_law_gives_out_more_than_was_put_in(name, seconds):
    """Tissue led from rest through any cycle and back has cost work, or none, while a driven law's clock stops."""
    term, steps = on_particles(name), 400
    rng = np.random.default_rng(3)
    X, Y, x, y = (rng.uniform(-1, 1, (20, *shape)) for shape in ((3, 3), (3, 3), (3,), (3,)))
    row, q, dt = term.row(laws.typical(term)), np.zeros((20, term.memory)), seconds / steps
    work, moved, before = np.zeros(20), np.zeros(20), None
    for k in range(steps + 1):
        a, b = np.sin(np.pi * k / steps) ** 2, np.sin(2 * np.pi * k / steps) * np.sin(np.pi * k / steps)
        da, db = (np.pi / seconds * c for c in cycle_rates(k / steps))
        F, u = np.eye(3) + 0.22 * (a * X + b * Y), 4e-3 * (a * x + b * y)
        D, v = laws.stretching(F, 0.22 * (da * X + db * Y)), 4e-3 * (da * x + db * y)
        if k:
            q = laws.remember(term, F, D, u, q, dt, row)
        P = laws.piola(F, laws.cauchy(term, F, D, q, 1.0, row))
        f = np.zeros((20, 3)) if term.force is None else forces(term, u, v, q, row)
        if before is not None:
            step = (0.5 * (P + before[0]) * (F - before[1])).sum((-1, -2))
            step = step - (0.5 * (f + before[2]) * (u - before[3])).sum(-1)
            work, moved = work + step, moved + np.abs(step)
        before = P, F, f, u
    assert (work >= -1e-3 * moved).all(), (work / moved).min()


def cycle_rates(share):
    """Slopes of the two shapes of the cycle by pi x its share."""
    s, c = np.sin(np.pi * share), np.cos(np.pi * share)
    return 2 * s * c, 2 * np.cos(2 * np.pi * share) * s + np.sin(2 * np.pi * share) * c


def forces(term, u, v, q, row):
    return np.stack([term.twin(*each, 1050.0, 1.0, **row) for each in zip(u, v, q, strict=True)])


@every_term
def test_off_is_off(name):
    term = on_particles(name)
    for precision in ROUNDING:
        for s, d in zip(laws.states(name), laws.device(name, precision), strict=True):
            if s.kind != "off":
                continue
            alone = np.zeros((3, 3))
            if laws.needs_base(term):
                ((base, values),) = laws.BASE.items()
                alone = laws.piola(s.F, TERMS[base].twin(s.F, np.zeros((3, 3)), **values))
            assert np.allclose(d.P, alone.ravel(), rtol=0, atol=ROUNDING[precision] * max(1e-9, np.abs(alone).max()))
            assert np.allclose(d.f, 0)


@every_term
def test_a_factor_lies_between_none_and_its_bound(name):
    term = TERMS[name]
    if term.factor is None:
        pytest.skip(f"{name} multiplies nothing")
    for s in laws.states(name):
        bound = 1.0 if term.stiffens is None else max(1.0, term.stiffens(**s.row))
        assert 0 < term.twin(s.F, s.q, **s.row) <= bound * (1 + 1e-12)


@every_term
def test_a_flow_keeps_volume(name):
    term = TERMS[name]
    if term.flow is None:
        pytest.skip(f"{name} does not flow")
    assert np.allclose([np.linalg.det(term.twin(s.q, **s.row)) for s in laws.states(name)], 1, rtol=1e-12)


@every_term
@precisions
def test_the_adjoint_is_the_slope_of_the_response(name, precision):
    on_particles(name)
    found, wanted, here = laws.device(name, precision), laws.slopes(name), laws.states(name)
    largest = max(np.linalg.norm(slope) for one in wanted for slope in one.values())
    for s, d, one in zip(here, found, wanted, strict=True):
        for argument, slope in one.items():
            if argument == "q" and s.kind == "fresh" and s.place in ("rest", "equal stretch"):
                continue  # Where nothing was ever felt, a memory of the largest value so far has its kink.
            mine = getattr(d, argument) * laws.size_of(argument, list(s.row.values()))
            if s.kind == "off" and argument == "theta":
                mine = d.theta @ laws.toward(name)
            error = np.linalg.norm(mine - slope)
            allowed = SLOPE[precision] * np.linalg.norm(slope) + FLOOR[precision] * largest
            assert error <= allowed, (s.kind, s.place, argument, error, np.linalg.norm(slope), largest)
