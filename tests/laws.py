"""Every law on the device and in its readable twin, at the same states, for the promises laws keep."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Term, catalogue, defaults
from surgisim.physics.fold import folded

TERMS = catalogue()
BASE = {"neo_hookean": {"E": 2e3, "nu": 0.4}}
"""What a law that changes others is laid upon."""
REAL = {"single": np.float32, "double": np.float64}
TURN = np.array([[-0.8, -0.6, 0.0], [0.6, -0.8, 0.0], [0.0, 0.0, 1.0]]) @ np.array(
    [[1.0, 0.0, 0.0], [0.0, 0.28, -0.96], [0.0, 0.96, 0.28]]
)
LIFT = np.array([0.0, 0.0, 1.5])
"""Most states are lifted toward the camera, as a grip would."""
DT = 0.004
ARGUMENTS = {"F": 1.0, "Fdot": 1.0, "u": 1e-3, "v": 1e-2, "q": 0.1, "theta": None, "rho": 1e3}
"""What is differentiated, and a typical size of it (theta's is its value)."""


def typical(term: Term) -> dict[str, float]:
    return defaults(term) | term.example


def silent(term: Term) -> dict[str, float]:
    return {n: typical(term)[n] if p.off is None else p.off for n, p in term.params.items()}


def on_particles(term: Term) -> bool:
    """Whether a particle's own response changes: not so for masses and moving boundaries."""
    return any(getattr(term, slot) is not None for slot in ("stress", "factor", "flow", "force", "advance"))


def needs_base(term: Term) -> bool:
    return term.factor is not None or term.flow is not None


def loaded(term: Term, values: dict[str, float], F, seconds=1.0, turning=False):
    """Memory after a load to F and half as far again that eases a little, by the twin."""
    row, steps = term.row(values), 25
    q = np.zeros((*np.shape(F)[:-2], term.memory))
    for k in range(1, steps + 1):
        G = np.eye(3) + (1.5 * np.sin(np.pi * 0.75 * k / steps)) * (F - np.eye(3))
        G = spun(k / steps) @ G if turning else G
        q = remember(term, G, np.zeros_like(G), np.zeros((*np.shape(F)[:-2], 3)), q, seconds / steps, row)
    return q


def spun(share: float) -> np.ndarray:
    """A rotation that comes a good way round by share = 1."""
    a, b = 2.5 * share, 1.3 * share
    x = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    return x @ np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])


def stretching(F, Fdot):
    L = Fdot @ np.linalg.inv(F)
    return (L + np.swapaxes(L, -1, -2)) / 2


def remember(term: Term, F, D, u, q, dt, row):
    return q if term.twin_advance is None else term.twin_advance(F, D, u, q, dt, **row)


def cauchy(term: Term, F, D, q, t, row):
    """Cauchy stress of the law, or of the base as the law changes it, by the twins [Pa]."""
    if term.stress is not None:
        return term.cauchy(F, D, q, t, row)
    if not needs_base(term):
        return np.zeros_like(F)
    ((base, values),) = BASE.items()
    if term.flow is not None:
        return TERMS[base].twin(F @ term.twin(q, **row), D, **values)
    factor = np.asarray(term.twin(F, q, **row))
    return factor[..., None, None] * TERMS[base].twin(F, D, **values)


def piola(F, sigma):
    return np.linalg.det(F)[..., None, None] * sigma @ np.swapaxes(np.linalg.inv(F), -1, -2)


def response(term: Term, s, row):
    """First Piola stress, force and memory after the step, as the engine defines them, by the twins."""
    D = stretching(s.F, s.Fdot)
    after = remember(term, s.F, D, s.u, s.q, DT, row)
    P = piola(s.F, cauchy(term, s.F, D, after, s.t, row))
    if term.balanced:
        P = P - cauchy(term, np.eye(3), np.zeros((3, 3)), after, s.t, row)
    f = np.zeros(3) if term.force is None else term.twin(s.u, s.v, after, s.rho, s.t, **row)
    return P, f, after


@cache
def states(name: str) -> list[SimpleNamespace]:
    """Rest, equal stretch, anywhere and turned far; fresh, after a load, and with the law switched off."""
    term, rng = TERMS[name], np.random.default_rng(0)
    anywhere = np.eye(3) + 0.25 * rng.uniform(-1, 1, (3, 3))
    past = np.eye(3) + 0.25 * rng.uniform(-1, 1, (3, 3))
    where = {"rest": np.eye(3), "equal stretch": 1.1 * np.eye(3), "anywhere": anywhere, "turned far": TURN @ anywhere}
    result = []
    for kind, values in (("fresh", typical(term)), ("loaded", typical(term)), ("off", silent(term))):
        for place, F in where.items():
            q = np.zeros(term.memory) if kind == "fresh" else loaded(term, values, past)
            moves = 0.0 if (place, kind) == ("rest", "fresh") else 1.0
            result.append(SimpleNamespace(
                kind=kind, place=place, row=term.row(values), F=F, Fdot=moves * rng.uniform(-1, 1, (3, 3)),
                u=moves * 6e-3 * (rng.uniform(-1, 1, 3) - LIFT), v=moves * 5e-2 * rng.uniform(-1, 1, 3), q=q,
                t=1.0, rho=1050.0,
                A=rng.standard_normal((3, 3)), b=1e-2 * rng.standard_normal(3),
                Q=1e3 * rng.standard_normal(term.memory),
            ))  # fmt: skip
    return result


@cache
def device(name: str, precision: str) -> list[SimpleNamespace]:
    """Response and slopes of the work A : P + b . f + Q . q' at every state, in one launch."""
    term = TERMS[name]
    base = BASE if needs_base(term) else {}
    laws = folded((name, *base), precision)
    Mat, Vec, Memory, Theta, real = laws.Mat, laws.Vec, laws.Memory, laws.Theta, laws.real
    work = laws.work

    @wp.kernel(module="unique", enable_backward=False)
    def evaluate(
        F: wp.array(dtype=Mat), Fdot: wp.array(dtype=Mat), u: wp.array(dtype=Vec), v: wp.array(dtype=Vec),
        q: wp.array(dtype=Memory), theta: wp.array(dtype=Theta), t: wp.array(dtype=real), dt: real,
        rho: wp.array(dtype=real), A: wp.array(dtype=Mat), b: wp.array(dtype=Vec), Q: wp.array(dtype=Memory),
        P: wp.array(dtype=Mat), f: wp.array(dtype=Vec), after: wp.array(dtype=Memory),
        dF: wp.array(dtype=Mat), dFdot: wp.array(dtype=Mat), du: wp.array(dtype=Vec), dv: wp.array(dtype=Vec),
        dq: wp.array(dtype=Memory), dtheta: wp.array(dtype=Theta), drho: wp.array(dtype=real),
    ):  # fmt: skip
        i = wp.tid()
        F0, Fdot0, u0, v0, q0, theta0, rho0 = F[i], Fdot[i], u[i], v[i], q[i], theta[i], rho[i]
        t0, A0, b0, Q0 = t[i], A[i], b[i], Q[i]
        # The work is linear in A, b and Q: its slopes by them are the response itself.
        a, c, d, e, g, h, _t, _dt, k, x, y, z = wp.grad(work)(F0, Fdot0, u0, v0, q0, theta0, t0, dt, rho0, A0, b0, Q0)
        P[i] = x
        f[i] = y
        after[i] = z
        dF[i] = a
        dFdot[i] = c
        du[i] = d
        dv[i] = e
        dq[i] = g
        dtheta[i] = h
        drho[i] = k

    here = states(name)
    below = [x for values in base.values() for x in values.values()]

    def put(values, dtype, width=None):
        values = np.array(values, REAL[precision])
        if width is not None and values.shape[1] < width:
            values = np.concatenate([values, np.zeros((len(values), width - values.shape[1]), values.dtype)], 1)
        return wp.array(values, dtype=dtype, device="cpu")

    inputs = [
        put([s.F for s in here], Mat), put([s.Fdot for s in here], Mat), put([s.u for s in here], Vec),
        put([s.v for s in here], Vec), put([s.q for s in here], Memory, max(1, laws.memory)),
        put([[*s.row.values(), *below] for s in here], Theta, max(1, laws.columns)), put([s.t for s in here], real),
        real(DT), put([s.rho for s in here], real), put([s.A for s in here], Mat), put([s.b for s in here], Vec),
        put([s.Q for s in here], Memory, max(1, laws.memory)),
    ]  # fmt: skip
    kinds = {
        "P": Mat, "f": Vec, "after": Memory,
        "F": Mat, "Fdot": Mat, "u": Vec, "v": Vec, "q": Memory, "theta": Theta, "rho": real,
    }  # fmt: skip
    outs = {n: wp.zeros(len(here), dtype=kind, device="cpu") for n, kind in kinds.items()}
    wp.launch(evaluate, len(here), [*inputs, *outs.values()], device="cpu")
    found = {n: out.numpy().astype(float).reshape(len(here), -1) for n, out in outs.items()}
    found["after"], found["q"] = found["after"][:, : term.memory], found["q"][:, : term.memory]
    found["theta"] = found["theta"][:, : len(here[0].row)]
    return [SimpleNamespace(**{n: a[i] for n, a in found.items()}) for i in range(len(here))]


@cache
def slopes(name: str) -> list[dict[str, np.ndarray]]:
    """Central differences of the same work by the twins, each times the size of what is differentiated.

    Where the law is off, its columns are moved together, and from there toward the law's own values only: what
    a diagnosis asks of a law that it has not switched on yet.
    """
    term = TERMS[name]

    def work(s, row):
        P, f, after = response(term, s, row)
        return (s.A * P).sum() + s.b @ f + s.Q @ after

    def onward(s):
        h = 1e-5
        at = [np.array(list(s.row.values())) + k * h * toward(name) for k in range(3)]
        a, b, c = (work(s, dict(zip(s.row, x, strict=True))) for x in at)
        return np.array([(4 * b - 3 * a - c) / (2 * h)])

    def slope(s, argument):
        if s.kind == "off" and argument == "theta":
            return onward(s)
        values = np.array(list(s.row.values())) if argument == "theta" else np.asarray(getattr(s, argument), float)
        result = np.zeros(values.size)
        for k in range(values.size):
            scale = size_of(argument, values.ravel()[k])
            ends = []
            for sign in (1, -1):
                moved = values.ravel().copy()
                moved[k] += sign * 2e-6 * scale
                if argument == "theta":
                    ends.append(work(s, dict(zip(s.row, moved, strict=True))))
                else:
                    changed = SimpleNamespace(**vars(s) | {argument: moved.reshape(values.shape)})
                    ends.append(work(changed, s.row))
            result[k] = (ends[0] - ends[1]) / 4e-6
        return result

    return [{a: slope(s, a) for a in ARGUMENTS} for s in states(name)]


def toward(name: str) -> np.ndarray:
    """From the columns of a law that is off to those of the law at work."""
    on, off = (TERMS[name].row(values(TERMS[name])) for values in (typical, silent))
    return np.array([on[c] - off[c] for c in on])


def size_of(argument: str, value):
    """What a slope is multiplied with, so that slopes by different things can be compared."""
    if argument != "theta":
        return ARGUMENTS[argument]
    return np.where(np.asarray(value) == 0, 1.0, np.abs(value))
