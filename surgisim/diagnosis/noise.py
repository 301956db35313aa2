"""The tracks' noise: how large, how alike among neighbours, how lasting; and the whitening that follows from it.

An axis of the error of point k at frame t is modelled as

    d_k [ shared(x, t) + lasting_k(t) + white_k(t) ]

shared: c exp(-|x - x'|^2 / 2 l^2) + rigid (a constant and a gradient over the tissue), in time rho^|t - t'|; lasting: a
r^|t - t'|; white: b. The numbers are those of largest restricted likelihood on frames in which the tissue is still,
each stretch less its own polynomial in time, so that what physics moves slowly is not counted as noise (Patterson and
Thompson, Recovery of inter-block information when block sizes are unequal, Biometrika 58, 1971). In the eigenvectors
of the spatial part every mode is a time series of its own, which a Cholesky factor whitens.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legvander
from scipy.optimize import minimize

MOST_POINTS = 90
"""Points whose covariance is fitted; all are whitened."""
SLOW = 4
"""Frames for each degree of the polynomial that is taken off a stretch."""
STRETCH = 24
"""Frames of a stretch where no frames are known to be still."""


@dataclass(frozen=True)
class Noise:
    """Variances in units of `level`^2."""

    level: np.ndarray
    """d_k [m], (K,)."""
    shared: float
    length: float
    """l [m]"""
    rigid: float
    tilt: float
    """Variance of the gradient's part at the distance of the tissue's RMS radius."""
    keep_shared: float
    """Correlation of successive frames, rho."""
    lasting: float
    keep: float
    """r"""
    white: float

    @property
    def sigma(self) -> float:
        """RMS error along an axis [m]."""
        total = self.shared + self.rigid + self.tilt + self.lasting + self.white
        return float(np.sqrt((self.level**2).mean() * total))

    def spatial(self, rest: np.ndarray) -> np.ndarray:
        """Covariance of the shared part, (K, K)."""
        return _spatial(rest, self.shared, self.length, self.rigid, self.tilt)

    def temporal(self, frames: int, modes: np.ndarray) -> np.ndarray:
        """Covariance in time of every spatial mode with eigenvalue `modes`, (M, T, T)."""
        return _temporal(np.arange(frames), modes, self.keep_shared, self.lasting, self.keep, self.white)

    def draw(self, rest: np.ndarray, frames: int, rng: np.random.Generator) -> np.ndarray:
        """Noise as modelled [m], (K, T, 3)."""
        values, axes = np.linalg.eigh(self.spatial(rest))
        factor = np.linalg.cholesky(self.temporal(frames, np.maximum(values, 0)))
        mode = np.einsum("mts,msc->mtc", factor, rng.standard_normal((len(rest), frames, 3)))
        return self.level[:, None, None] * np.einsum("km,mtc->ktc", axes, mode)


@dataclass(frozen=True)
class Whitener:
    """Turns displacements (K, T, 3) into numbers of unit variance, less a constant of each point, (K T 3,)."""

    scale: np.ndarray
    axes: np.ndarray
    inverse: np.ndarray
    """Inverse Cholesky factors, (M, T, T)."""
    still: np.ndarray
    """What a constant becomes, of unit length, (M, T)."""
    mask: np.ndarray
    """(K, T)"""

    def __call__(self, field: np.ndarray) -> np.ndarray:
        """Of fields [m], (..., K, T, 3), as (..., K T 3) float64."""
        scaled = field * (self.mask * self.scale[:, None])[..., None]
        mode = np.tensordot(self.axes.T, np.moveaxis(scaled, -3, 0), (1, 0))
        shape = mode.shape
        mode = np.moveaxis(mode, -2, 1).reshape(shape[0], shape[-2], int(np.prod(shape[1:-2])) * shape[-1])
        white = self.inverse @ mode
        white = white - self.still[:, :, None] * (self.still[:, None] @ white)
        white = white.reshape(shape[0], shape[-2], *shape[1:-2], shape[-1])
        white = np.moveaxis(np.moveaxis(white, 1, -2), 0, -3)
        return white.reshape(*white.shape[:-3], int(np.prod(white.shape[-3:])))

    def back(self, white: np.ndarray) -> np.ndarray:
        """The transpose: of numbers (K T 3,), as (K, T, 3)."""
        mode = white.reshape(len(self.scale), -1, 3).astype(float)
        mode = mode - self.still[:, :, None] * (self.still[:, None] @ mode)
        mode = np.swapaxes(self.inverse, 1, 2) @ mode
        return np.tensordot(self.axes, mode, (1, 0)) * (self.mask * self.scale[:, None])[..., None]

    def without_constant(self, white: np.ndarray) -> np.ndarray:
        """Numbers (K T 3, C) less what a constant of each point could be."""
        parts = white.reshape(*self.still.shape, 3, -1)
        still = self.still.astype(white.dtype)
        parts = parts - still[:, :, None, None] * np.einsum("mt,mtic->mic", still, parts)[:, None]
        return parts.reshape(white.shape)


def whitener(noise: Noise, rest: np.ndarray, seen: np.ndarray, offsets: bool = True) -> Whitener:
    """For points `rest` [m], (K, 3), seen where `seen`, (K, T); `offsets`: whether each has a constant of its own."""
    values, axes = np.linalg.eigh(noise.spatial(rest))
    factor = np.linalg.cholesky(noise.temporal(seen.shape[1], np.maximum(values, 0)))
    inverse = np.linalg.inv(factor)
    still = inverse.sum(-1)
    still = still / np.linalg.norm(still, axis=1, keepdims=True) * offsets
    return Whitener(1 / noise.level, axes, inverse, still, seen.astype(float))


def estimate(moved: np.ndarray, seen: np.ndarray, rest: np.ndarray, still: np.ndarray, nominal: np.ndarray) -> Noise:
    """From displacements [m], (K, T, 3), where `seen`, (K, T), on frames that are `still`, (T,) bool.

    nominal: what the recording says of each point's noise [m], (K,); it decides where nothing can be estimated.
    """
    level = _levels(moved, seen, nominal)
    stretches = _stretches(still)
    rng = np.random.default_rng(0)
    chosen = np.arange(len(rest)) if len(rest) <= MOST_POINTS else np.sort(rng.permutation(len(rest))[:MOST_POINTS])
    data = []
    for frames in stretches:
        mine = chosen[seen[np.ix_(chosen, frames)].all(1)]
        if len(mine) < 4:
            continue
        slow = legvander(np.linspace(-1, 1, len(frames)), max(1, len(frames) // SLOW))
        basis = np.linalg.qr(slow, mode="complete")[0][:, slow.shape[1] :]
        data.append(
            (
                rest[mine],
                frames,
                basis,
                np.einsum("ts,ktc->ksc", basis, moved[np.ix_(mine, frames)] / level[mine, None, None]),
            )
        )
    if not data:
        return Noise(np.maximum(level, 1e-9), 0.2, 0.006, 0.02, 0.02, 0.7, 0.3, 0.75, 0.45)

    def cost(x: np.ndarray) -> float:
        part = _unpacked(x)
        total = 0.5 * float(((x - START) ** 2 / SPREAD**2).sum())
        for where, frames, basis, z in data:
            values, axes = np.linalg.eigh(_spatial(where, part["shared"], part["length"], part["rigid"], part["tilt"]))
            cov = _temporal(
                np.arange(len(frames)),
                np.maximum(values, 0),
                part["keep_shared"],
                part["lasting"],
                part["keep"],
                part["white"],
            )
            cov = basis.T @ cov @ basis
            factor = np.linalg.cholesky(cov)
            mode = np.einsum("km,ksc->msc", axes, z)
            white = np.linalg.solve(factor, mode)
            total += 0.5 * float((white**2).sum()) + 3 * float(np.log(np.diagonal(factor, axis1=1, axis2=2)).sum())
        return total

    found = minimize(
        cost,
        START,
        method="Nelder-Mead",
        options={
            "maxfev": 420,
            "xatol": 0.03,
            "fatol": 0.5,
            "initial_simplex": START + np.vstack([np.zeros(len(START)), 0.5 * np.eye(len(START))]),
        },
    )
    return Noise(level, **_unpacked(found.x))


START = np.array([-1.2, np.log(0.006), -3.0, -3.0, 1.0, -1.2, 1.0, -0.8])
SPREAD = np.array([1.5, 0.6, 1.5, 1.5, 1.0, 1.5, 1.0, 1.5])
"""Of the prior on: log shared, log length [m], log rigid, log tilt, logit rho, log lasting, logit r, log white."""


def _unpacked(x: np.ndarray) -> dict[str, float]:
    e, s = np.exp(np.clip(x, -12, 6)), 0.97 / (1 + np.exp(-x))
    return {
        "shared": e[0], "length": e[1], "rigid": e[2], "tilt": e[3], "keep_shared": s[4], "lasting": e[5],
        "keep": s[6], "white": e[7] + 1e-3,
    }  # fmt: skip


def _spatial(rest, shared, length, rigid, tilt) -> np.ndarray:
    away = ((rest[:, None] - rest[None]) ** 2).sum(-1)
    arm = rest - rest.mean(0)
    reach = max(float((arm**2).sum(1).mean()), 1e-12)
    return shared * np.exp(-0.5 * away / length**2) + rigid + tilt * (arm @ arm.T) / reach


def _temporal(frames, modes, keep_shared, lasting, keep, white) -> np.ndarray:
    lag = np.abs(frames[:, None] - frames[None])
    own = lasting * keep**lag + white * np.eye(len(frames))
    return modes[:, None, None] * keep_shared**lag + own


def _levels(moved, seen, nominal) -> np.ndarray:
    """Each point's own level, from differences of successive frames, drawn towards what all have."""
    both = seen[:, 1:] & seen[:, :-1]
    step = np.diff(moved, axis=1)
    size = np.array([np.median(np.abs(s[b])) if b.sum() > 6 else np.nan for s, b in zip(step, both, strict=True)])
    if not np.isfinite(size).any() or not np.nanmedian(size) > 0:
        return np.maximum(nominal, 1e-6)
    middle = np.nanmedian(size)
    share = np.where(np.isfinite(size), size, middle) / middle
    # A median of some hundred correlated steps is known to about a tenth.
    share = np.exp(0.7 * np.log(np.clip(share, 0.3, 3.0)))
    known = nominal[np.isfinite(nominal) & (nominal > 0)]
    unit = float(np.median(known)) if len(known) else 1.5 * middle
    return unit * share


def _stretches(still: np.ndarray) -> list[np.ndarray]:
    frames = np.flatnonzero(still)
    parts = [p for p in np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1) if len(p) >= 6]
    if not parts:
        parts = np.array_split(np.arange(len(still)), max(1, len(still) // STRETCH))
    return [q for p in parts for q in np.array_split(p, max(1, len(p) // (2 * STRETCH)))]
