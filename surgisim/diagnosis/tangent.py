"""How the simulated body answers small forces: the stiffness of the base run, state by state.

Between two frames tissue comes to rest (its waves and its viscosity take milliseconds), so what a small extra load f
does to the observed points is, to first order,

    du(t) = C K(t)^-1 f(t)

with K the tangent stiffness of the laws that store energy, and of the anchors, at the run's own state at t, and C the
interpolation from nodes to points. K is factored at a few states; frames between take the nearest two. So thousands of
possible causes are tried at the price of a few factorisations, where each would be a run of its own. What it leaves
out, inertia and what is not small, the refits with the engine put back.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.linalg import LinAlgError, cho_factor, cho_solve, lu_factor, lu_solve

from surgisim.mpm.grip import Drive
from surgisim.mpm.setup import Prepared, Values
from surgisim.mpm.simulator import Run
from surgisim.physics.catalogue import Term, choose

STATES = 7
"""Most states at which the stiffness is factored."""
SMALL = 1e-6
"""Step of the central differences of a stress."""


@dataclass(frozen=True)
class Tangent:
    prepared: Prepared
    values: Values
    drive: Drive
    run: Run
    frames: np.ndarray
    """Frame of every state, (S,)."""
    share: np.ndarray
    """What every frame takes from the states, (T, S); rows sum to 1."""
    answer: np.ndarray
    """C K^-1 of every state [m/N], (S, 3 K, 3 A)."""
    slope: sparse.csr_matrix
    """Nodal displacement to the particles' displacement gradient, (9 P, 3 A)."""
    value: sparse.csr_matrix
    """Nodal displacement to the particles', (3 P, 3 A)."""

    def gradient(self, frame: int) -> np.ndarray:
        """F of every particle, (P, 3, 3)."""
        return np.eye(3) + (self.slope @ self.run.u[frame].astype(float).ravel()).reshape(-1, 3, 3)

    def displacement(self, frame: int) -> np.ndarray:
        """Of every particle [m], (P, 3)."""
        return (self.value @ self.run.u[frame].astype(float).ravel()).reshape(-1, 3)

    def of_stress(self, piola: np.ndarray) -> np.ndarray:
        """Nodal forces [N], (..., 3 A), of first Piola stresses [Pa], (..., P, 3, 3)."""
        volume = self.prepared.simulator.volume_p
        flat = (piola * volume[:, None, None]).reshape(*piola.shape[:-3], -1)
        return -(self.slope.T @ flat.T).T if flat.ndim == 1 else -(self.slope.T @ flat.reshape(-1, flat.shape[-1]).T).T

    def of_push(self, force: np.ndarray) -> np.ndarray:
        """Nodal forces [N], (..., 3 A), of forces per volume [N/m^3], (..., P, 3)."""
        volume = self.prepared.simulator.volume_p
        flat = (force * volume[:, None]).reshape(-1, 3 * len(volume))
        return (self.value.T @ flat.T).T

    def at_states(self, force: np.ndarray) -> np.ndarray:
        """Displacement of the points [m], (S, C, K, 3), by C nodal forces of every state [N], (S, C, 3 A)."""
        answer = np.einsum("ska,sca->sck", self.answer, force, optimize=True)
        return answer.reshape(*answer.shape[:2], -1, 3)

    def over_time(self, states: np.ndarray, course: np.ndarray | None = None) -> np.ndarray:
        """From states, (S, K, 3), to frames, (K, T, 3), times a course (T,)."""
        share = self.share if course is None else self.share * course[:, None]
        return np.einsum("ts,ski->kti", share, states, optimize=True)

    def history(self, force: np.ndarray) -> np.ndarray:
        """Displacement of the points [m], (K, T, 3), by a nodal force at every frame [N], (T, 3 A)."""
        total = np.zeros((len(force), self.answer.shape[1]))
        for s, answer in enumerate(self.answer):
            mine = self.share[:, s] > 0
            total[mine] += self.share[mine, s, None] * (force[mine] @ answer.T)
        return total.reshape(len(force), -1, 3).swapaxes(0, 1)

    def anchored(self, anchor: int, field: np.ndarray | None = None) -> np.ndarray:
        """Forces [N], (3 A, 3), by a shift of an anchor by one metre along each axis, or of each particle that it holds
        by `field` metres, (P,)."""
        simulator, drive = self.prepared.simulator, self.drive
        member = ((drive.member >> anchor) & 1).astype(float) * drive.share * simulator.volume_p
        member = member if field is None else member * field
        spring = drive.stiffness[anchor] * simulator.density
        push = member[:, None, None] * spring[None]
        return self.value.T @ push.reshape(-1, 3)


def tangent(prepared: Prepared, values: Values, drive: Drive, run: Run, points: np.ndarray, until: int) -> Tangent:
    """Of a base run, for points at rest [m], (K, 3), and frames before `until`."""
    simulator = prepared.simulator
    value, slope = operators(prepared)
    carry = simulator.carry(points)
    read = sparse.kron(carry, sparse.identity(3)).tocsr()
    frames, share = states_of(run, drive, until)
    answers = []
    for frame in frames:
        K = stiffness(prepared, values, drive, run.u[frame].astype(float), _hold(drive, frame), slope, value)
        try:
            answers.append(cho_solve(cho_factor(K, overwrite_a=False), read.T.toarray(), overwrite_b=True).T)
        except LinAlgError:
            answers.append(lu_solve(lu_factor(K), read.T.toarray()).T)
    return Tangent(prepared, values, drive, run, frames, share, np.stack(answers), slope, value)


def operators(prepared: Prepared) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """From nodal displacements to the particles', (3 P, 3 A), and to their gradients, (9 P, 3 A)."""
    simulator = prepared.simulator
    index, link = simulator.rest_links
    count, links = index.shape
    nodes = len(simulator.place)
    p, k = np.repeat(np.arange(count), links), index.ravel()
    value = sparse.csr_matrix((np.repeat(link[..., 0].ravel(), 3), (_fan(3 * p), _fan(3 * k))), (3 * count, 3 * nodes))
    rows = (9 * p[:, None, None] + 3 * np.arange(3)[None, :, None] + np.arange(3)[None, None, :]).ravel()
    cols = np.broadcast_to(3 * k[:, None, None] + np.arange(3)[None, :, None], (len(p), 3, 3)).ravel()
    data = np.broadcast_to(link[..., 1:].reshape(-1, 1, 3), (len(p), 3, 3)).ravel()
    slope = sparse.csr_matrix((data, (rows, cols)), (9 * count, 3 * nodes))
    return value, slope


def states_of(run: Run, drive: Drive, until: int) -> tuple[np.ndarray, np.ndarray]:
    """Frames that stand for all before `until`, (S,), and what each frame takes from them, (T, S)."""
    u = run.u[:until].reshape(until, -1).astype(float)
    kind = np.array([tuple(_hold(drive, t) > 0) for t in range(until)])
    _, pattern = np.unique(kind, axis=0, return_inverse=True)
    pattern = pattern.ravel()
    size = max(np.linalg.norm(u, axis=1).max(), 1e-12)
    # The first frame of every pattern of grips, then whatever is farthest from all that are chosen.
    chosen = [int(np.flatnonzero(pattern == k)[0]) for k in np.unique(pattern)]
    chosen = sorted({0, *chosen})

    def away(frame: int) -> np.ndarray:
        return np.where(pattern == pattern[frame], np.linalg.norm(u - u[frame], axis=1), np.inf)

    nearest = np.minimum.reduce([away(f) for f in chosen])
    while len(chosen) < STATES and nearest.max() > 0.02 * size:
        chosen.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, away(chosen[-1]))
    frames = np.array(sorted(chosen))
    share = np.zeros((until, len(frames)))
    for t in range(until):
        mine = np.flatnonzero(pattern[frames] == pattern[t])
        best = (np.inf, 0, 0, 0.0)
        for a in mine:
            for b in mine:
                way = u[frames[b]] - u[frames[a]]
                part = float(np.clip((u[t] - u[frames[a]]) @ way / max(way @ way, 1e-30), 0, 1))
                gap = float(np.linalg.norm(u[t] - u[frames[a]] - part * way))
                best = min(best, (gap, int(a), int(b), part))
        share[t, best[1]] += 1 - best[3]
        share[t, best[2]] += best[3]
    return frames, share


def piola(term: Term, F: np.ndarray, row: dict, q: np.ndarray | None = None, t: float = 0.0) -> np.ndarray:
    """First Piola stress [Pa] of one law where nothing moves, (P, 3, 3)."""
    D = np.zeros_like(F)
    q = np.zeros((len(F), term.memory)) if q is None else q
    sigma = term.cauchy(F, D, q, t, row)
    return np.linalg.det(F)[:, None, None] * sigma @ np.swapaxes(np.linalg.inv(F), -1, -2)


def base_piola(prepared: Prepared, values: Values, F: np.ndarray) -> np.ndarray:
    """Of all laws that store energy and forget nothing [Pa], (P, 3, 3)."""
    total = np.zeros_like(F)
    for name, term in choose(prepared.terms).items():
        if term.energy is not None and not term.memory:
            total += piola(term, F, term.row(values[name]))
    return total


def stiffness(prepared: Prepared, values: Values, drive: Drive, u: np.ndarray, hold: np.ndarray, slope, value):
    """Of elastic laws and anchors at nodal displacements u [m], (A, 3), that hold by these shares, (1 + J,) [N/m],
    (3 A, 3 A); slope and value: `operators`."""
    F = np.eye(3) + (slope @ u.ravel()).reshape(-1, 3, 3)
    count = len(F)
    moduli = np.zeros((count, 9, 9))
    for c in range(9):
        step = np.zeros((3, 3))
        step.flat[c] = SMALL
        up, down = (base_piola(prepared, values, F + s * step) for s in (1, -1))
        moduli[:, :, c] = ((up - down) / (2 * SMALL)).reshape(count, 9)
    volume = prepared.simulator.volume_p
    blocks = sparse.bsr_matrix((moduli * volume[:, None, None], np.arange(count), np.arange(count + 1)))
    K = slope.T @ (blocks.tocsr() @ slope)
    density = prepared.simulator.density
    for a, strength in enumerate(hold):
        if strength > 0:
            share = ((drive.member >> a) & 1) * drive.share * volume * strength
            spring = sparse.bsr_matrix(
                (share[:, None, None] * (drive.stiffness[a] * density)[None], np.arange(count), np.arange(count + 1))
            )
            K = K + value.T @ (spring.tocsr() @ value)
    K = K.toarray()
    K = 0.5 * (K + K.T)
    # A body that nothing holds floats: a trace of the stiffness keeps it solvable.
    return K + 1e-9 * np.trace(K) / len(K) * np.eye(len(K))


def _hold(drive: Drive, frame: int) -> np.ndarray:
    return drive.hold[:, min(max(frame * drive.per_frame - 1, 0), drive.steps - 1)]


def _fan(first: np.ndarray) -> np.ndarray:
    return (first[:, None] + np.arange(3)).ravel()
