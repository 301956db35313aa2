"""A linear viscoelastic rod in one dimension: its stress, and how it creeps under its own weight.

    sigma(t) = E eps + eta d(eps)/dt + sum_b E_b int exp(-(t - s) / tau_b) d(eps)/ds ds

E alone and eta: Kelvin-Voigt; E and one branch: the standard linear solid; branches alone: Maxwell.
Christensen, Theory of Viscoelasticity (1982), chapter 1.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

MODES = 40


@dataclass(frozen=True)
class LinearSolid:
    E: float
    """Long-time modulus [Pa]."""
    eta: float = 0.0
    """Axial viscosity [Pa s]."""
    branches: tuple[tuple[float, float], ...] = ()
    """Modulus [Pa] and relaxation time [s] of every Maxwell branch."""
    fast_nu: float = 0.0
    """Poisson's ratio of what is too fast to relax."""

    @classmethod
    def of_shear(cls, E: float, nu: float, g: float, tau: float) -> "LinearSolid":
        """A thin rod of a solid whose shear relaxes, mu + g exp(-t / tau), and whose bulk modulus does not.

        E [Pa] and nu are the long-time ones, g [Pa] the branch's shear modulus. By correspondence the rod's modulus is
        9 K mu / (3 K + mu) with mu(s) = mu + g s tau / (1 + s tau), which again has a single pole: one branch, slower
        than tau by (3 K + mu + g) / (3 K + mu).
        """
        mu, K = E / (2 * (1 + nu)), E / (3 * (1 - 2 * nu))
        fast = mu + g
        branch = 9 * K * fast / (3 * K + fast) - E, tau * (3 * K + fast) / (3 * K + mu)
        return cls(E, branches=(branch,), fast_nu=(3 * K - 2 * fast) / (2 * (3 * K + fast)))

    @property
    def fast(self) -> float:
        """Modulus of what is too fast to relax [Pa]."""
        return self.E + sum(modulus for modulus, _ in self.branches)

    def stress(self, time: np.ndarray, strain: np.ndarray) -> np.ndarray:
        """Stress [Pa] of a strain history (T,) at `time` [s], taken as straight between its samples."""
        rate = np.diff(strain) / np.diff(time)
        total = self.E * strain + self.eta * np.gradient(strain, time)
        for modulus, tau in self.branches:
            part = np.zeros_like(strain)
            for n, dt in enumerate(np.diff(time)):
                decay = np.exp(-dt / tau)
                part[n + 1] = decay * part[n] + modulus * rate[n] * tau * (1 - decay)
            total = total + part
        return total

    def hung(self, time: np.ndarray, x: np.ndarray, length: float, density: float, gravity: float) -> np.ndarray:
        """Displacement [m] of a hanging rod at x (Q,) below its clamp [m], (T, Q), when gravity is switched on at 0.

        A viscous one begins undeformed; another begins where it would hang if nothing relaxed, and does not bounce.
        Modes sin(k x), k = (2 n - 1) pi / (2 L); inertia included. `time` [s], (T,), begins at 0 and is evenly spaced.
        """
        total = np.zeros((len(time), len(x)))
        for n in range(1, MODES + 1):
            k = (2 * n - 1) * np.pi / (2 * length)
            stiff = k**2 / density
            # State: displacement, speed, one force a branch, and 1 for the load.
            A = np.zeros((3 + len(self.branches),) * 2)
            A[0, 1] = 1
            A[1, :2] = -stiff * self.E, -stiff * self.eta
            A[1, -1] = 2 * gravity / (length * k)
            for b, (modulus, tau) in enumerate(self.branches):
                A[1, 2 + b] = -stiff
                A[2 + b, 1], A[2 + b, 2 + b] = modulus, -1 / tau
            step, state = expm(A * (time[1] - time[0])), np.zeros(len(A))
            state[-1] = 1
            if not self.eta:
                state[0] = A[1, -1] / (stiff * self.fast)
                state[2:-1] = [modulus * state[0] for modulus, _ in self.branches]
            shape = np.sin(k * x)
            for t in range(len(time)):
                total[t] += shape * state[0]
                state = step @ state
        return total
