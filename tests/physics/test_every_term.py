"""Promises that every law keeps; a new file in physics/terms/ is tested unasked."""

import numpy as np
import pytest
import warp as wp

from surgisim.physics.catalogue import catalogue
from surgisim.physics.fold import fold, power

TERMS = catalogue()
every_term = pytest.mark.parametrize("name", TERMS)


def generic(seed=0, size=0.25):
    rng = np.random.default_rng(seed)
    return np.eye(3) + size * rng.uniform(-1, 1, (3, 3)), rng.uniform(-1, 1, (3, 3))


def stretching(F, rate):
    L = rate @ np.linalg.inv(F)
    return (L + L.T) / 2


def typical(term):
    return {n: p.default for n, p in term.params.items()}


def device_stress(name, F, D, values):
    total = fold({name: TERMS[name]})
    Theta = wp.types.vector(len(values), float)

    @wp.kernel(module="unique")
    def evaluate(F: wp.array(dtype=wp.mat33), D: wp.array(dtype=wp.mat33), theta: Theta, out: wp.array(dtype=wp.mat33)):
        out[0] = total(F[0], D[0], theta)

    out = wp.zeros(1, dtype=wp.mat33)
    one = [wp.array(np.asarray(a, np.float32)[None], dtype=wp.mat33) for a in (F, D)]
    wp.launch(evaluate, 1, [*one, Theta(*values.values()), out])
    return out.numpy()[0].astype(float)


@every_term
def test_the_device_says_what_the_readable_twin_says(name):
    F, rate = generic()
    D, values = stretching(F, rate), typical(TERMS[name])
    wanted = TERMS[name].twin(F, D, **values)
    assert np.allclose(device_stress(name, F, D, values), wanted, atol=2e-5 * np.abs(wanted).max())


@every_term
def test_tissue_at_rest_is_free_of_stress(name):
    assert np.allclose(TERMS[name].twin(np.eye(3), np.zeros((3, 3)), **typical(TERMS[name])), 0)


@every_term
def test_stress_is_symmetric(name):
    F, rate = generic()
    stress = TERMS[name].twin(F, stretching(F, rate), **typical(TERMS[name]))
    assert np.allclose(stress, stress.T)


@every_term
def test_turning_the_camera_turns_the_stress(name):
    F, rate = generic()
    D, values = stretching(F, rate), typical(TERMS[name])
    Q, _ = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))
    Q = Q * np.sign(np.linalg.det(Q))
    turned = TERMS[name].twin(Q @ F, Q @ D @ Q.T, **values)
    assert np.allclose(turned, Q @ TERMS[name].twin(F, D, **values) @ Q.T)


@every_term
def test_stress_is_the_slope_of_its_energy(name):
    term, (F, _) = TERMS[name], generic()
    if term.energy is None:
        pytest.skip(f"{name} stores no energy")
    values, h = typical(term), 1e-6
    slope = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            step = np.zeros((3, 3))
            step[i, j] = h
            slope[i, j] = (term.energy(F + step, **values) - term.energy(F - step, **values)) / (2 * h)
    cauchy = slope @ F.T / np.linalg.det(F)
    assert np.allclose(term.twin(F, np.zeros((3, 3)), **values), cauchy, rtol=1e-6, atol=1e-5 * np.abs(cauchy).max())


@every_term
def test_what_is_lost_is_never_gained(name):
    """Stress beyond the elastic part takes power out: (sigma(F, D) - sigma(F, 0)) : D >= 0."""
    F, rate = generic()
    D, values = stretching(F, rate), typical(TERMS[name])
    lost = TERMS[name].twin(F, D, **values) - TERMS[name].twin(F, 0 * D, **values)
    assert (lost * D).sum() >= 0


@every_term
def test_off_is_off(name):
    term = TERMS[name]
    assert any(p.off is not None for p in term.params.values()), f"{name} cannot be switched off"
    F, rate = generic()
    silent = {n: p.default if p.off is None else p.off for n, p in term.params.items()}
    assert np.allclose(term.twin(F, stretching(F, rate), **silent), 0)


@every_term
@pytest.mark.parametrize("state", ["rest", "equal stretch", "anywhere", "turned far"])
def test_the_adjoint_is_the_slope_of_the_stress(name, state):
    term, values = TERMS[name], typical(TERMS[name])
    F, rate = generic()
    turn = np.array([[-0.8, -0.6, 0.0], [0.6, -0.8, 0.0], [0.0, 0.0, 1.0]])
    F = {"rest": np.eye(3), "equal stretch": 1.1 * np.eye(3), "anywhere": F, "turned far": turn @ F}[state]
    A = np.random.default_rng(2).standard_normal((3, 3))
    work, theta = power({name: term}), np.array(list(values.values()))
    Theta = wp.types.vector(len(theta), float)

    @wp.kernel(module="unique", enable_backward=False)
    def slopes(
        F: wp.array(dtype=wp.mat33),
        rate: wp.array(dtype=wp.mat33),
        A: wp.array(dtype=wp.mat33),
        theta: Theta,
        F_bar: wp.array(dtype=wp.mat33),
        rate_bar: wp.array(dtype=wp.mat33),
        theta_bar: wp.array(dtype=Theta),
    ):
        dF, drate, dtheta, _dA = wp.grad(work)(F[0], rate[0], theta, A[0])
        F_bar[0] = dF
        rate_bar[0] = drate
        theta_bar[0] = dtheta

    inputs = [wp.array(np.asarray(a, np.float32)[None], dtype=wp.mat33) for a in (F, rate, A)]
    outs = [wp.zeros(1, dtype=wp.mat33), wp.zeros(1, dtype=wp.mat33), wp.zeros(1, dtype=Theta)]
    wp.launch(slopes, 1, [*inputs, Theta(*theta), *outs])

    def wanted(F, rate, theta):
        stress = term.twin(F, stretching(F, rate), **dict(zip(values, theta, strict=True)))
        return (A * (np.linalg.det(F) * stress @ np.linalg.inv(F).T)).sum()

    for k, (value, out) in enumerate(zip((F, rate, theta), outs, strict=True)):
        slope = differences(lambda x, k=k: wanted(*(x if m == k else y for m, y in enumerate((F, rate, theta)))), value)
        assert np.allclose(out.numpy()[0], slope, atol=1e-3 * max(np.abs(slope).max(), 1e-6)), (
            k,
            out.numpy()[0],
            slope,
        )


def differences(f, x):
    slope = np.zeros_like(x)
    for place in np.ndindex(x.shape):
        h = 1e-6 * max(1.0, abs(x[place]))
        up, down = x.copy(), x.copy()
        up[place] += h
        down[place] -= h
        slope[place] = (f(up) - f(down)) / (2 * h)
    return slope
