"""The tracks' noise: how large, how alike among neighbours, how lasting; and the whitening that follows from it.

An axis of the error of point k at frame t is modelled as

    d_k a_k [ shared(x, t) + camera(x, t) + lasting_k(t) + white_k(t) ]

a_k: that axis over all three of the point, 1 where they are alike; of a clip depth is less sure than what lies across
the view. shared: c exp(-|x - x'|^2 / 2 l^2), in time rho^|t - t'|; camera: a constant and a gradient over the tissue,
which shake from frame to frame, in time s^|t - t'|; lasting: a r^|t - t'|; white: b (noise_fit.py tells the numbers).
Patterns over the points (constant, gradients, then the eigenvectors of what is shared) are each a time series of their
own, which a Cholesky factor whitens.

What is not seen has no value: every sample that is missing is a direction of infinite variance, and so is each point's
constant. Projecting those out of the whitened vectors is the exact marginal likelihood of the samples that are there.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from surgisim.diagnosis.device_whitener import DeviceWhitener
from surgisim.recordings.ways import told_of, turned

PARTS = ("shared", "rigid", "tilt", "lasting", "white")
"""Variances of a `Noise`."""


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
    keep_rigid: float
    """s"""
    lasting: float
    keep: float
    """r"""
    white: float
    axes: np.ndarray | None = None
    """a_k of every axis [1], (K, 3), of RMS 1 for each point; None where all are alike."""
    ways: np.ndarray | None = None
    """Directions of those axes, rows for each point, (K, 3, 3); None where they are x, y and z."""
    rough: np.ndarray | None = None
    """What is white besides in each frame, (T,); None where all frames are alike."""

    @property
    def scale(self) -> np.ndarray:
        """d_k a_k [m], (K, 3)."""
        return self.level[:, None] * (np.ones((1, 3)) if self.axes is None else self.axes)

    @property
    def surest(self) -> np.ndarray:
        """d_k a_k of each point's surest axis [m], (K,)."""
        return self.scale.min(1)

    @property
    def each(self) -> np.ndarray:
        """RMS error of each point along its surest axis in frames that are still [m], (K,)."""
        return self.sigma * self.surest / np.sqrt((self.level**2).mean())

    def of(self, mine: np.ndarray) -> "Noise":
        """That of some of the points, as (M,) or (K,) bool chooses them."""
        parts = {name: value[mine] for name in ("level", "axes", "ways") if (value := getattr(self, name)) is not None}
        return replace(self, **parts)

    def told_of(self, field: np.ndarray) -> np.ndarray:
        """What the recording can tell of displacements [m], (..., K, T, 3)."""
        return told_of(field, self.axes, self.ways)

    @property
    def sigma(self) -> float:
        """RMS error along an axis [m]."""
        return float(np.sqrt((self.level**2).mean() * sum(getattr(self, name) for name in PARTS)))

    @property
    def plain(self) -> float:
        """RMS error along the axis that is surest [m], of all frames."""
        more = 0.0 if self.rough is None else float(self.rough.mean() * (self.level**2).mean())
        return float(np.hypot(self.sigma, np.sqrt(more))) * (
            1.0 if self.axes is None else float(np.sqrt((self.axes.min(1) ** 2).mean()))
        )

    def told(self) -> dict[str, Any]:
        """Its numbers as a diagnosis holds them: means over the points; `axes` along x, y and z or the
        points' own ways, None if alike."""
        numbers = {k: float(np.mean(v)) for k, v in vars(self).items() if k not in ("axes", "ways", "rough")}
        axes = None if self.axes is None else self.axes.mean(0).tolist()
        rough = None if self.rough is None else float(np.mean(self.rough))
        return numbers | {"axes": axes, "rough": rough, "sigma": self.sigma, "unit": "m"}

    def modes(self, rest: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Patterns over the points, (K, K), orthonormal columns, and each one's shared and camera variance, (K,)."""
        return modes_of(rest, self.shared, self.length, self.rigid, self.tilt)

    def temporal(self, frames: int, shared: np.ndarray, camera: np.ndarray) -> np.ndarray:
        """Covariance in time of every pattern, (M, T, T)."""
        found = covariance_in_time(
            np.arange(frames), shared, camera, self.keep_shared, self.keep_rigid, self.lasting, self.keep, self.white
        )
        return found if self.rough is None else found + np.diag(self.rough[:frames])

    def draw(self, rest: np.ndarray, frames: int, rng: np.random.Generator) -> np.ndarray:
        """Noise as modelled [m], (K, T, 3)."""
        axes, shared, camera = self.modes(rest)
        factor = np.linalg.cholesky(self.temporal(frames, shared, camera))
        mode = np.einsum("mts,msc->mtc", factor, rng.standard_normal((len(rest), frames, 3)))
        return turned(self.scale[:, None] * np.einsum("km,mtc->ktc", axes, mode), self.ways, back=True)


@dataclass(frozen=True)
class Whitener:
    """Turns displacements (K, T, 3) into numbers of unit variance, less what cannot be known, (K T 3,).

    That is a constant of each point, and every sample that was not seen.
    """

    scale: np.ndarray
    """One over the noise of each axis [1/m], (K, 3)."""
    axes: np.ndarray
    inverse: np.ndarray
    """Inverse Cholesky factors, (M, T, T)."""
    still: np.ndarray
    """What a constant becomes, of unit length, (M, T)."""
    mask: np.ndarray
    """(K, T)"""
    lost: np.ndarray
    """Orthonormal, what missing samples become, of one axis, (K T, L) float32."""
    ways: np.ndarray | None = None
    """Directions of each point's axes, (K, 3, 3); x, y and z if None."""
    device: str = "cpu"
    """Where fields are whitened."""

    def __call__(self, field: np.ndarray) -> np.ndarray:
        """Of fields [m], (..., K, T, 3), as (..., K T 3), in their own precision."""
        kind = np.float32 if field.dtype == np.float32 else float
        if self.device != "cpu":
            there = self._there_single if kind is np.float32 else self._there
            return there.of_fields(turned(field.astype(kind, copy=False), self.ways))
        scaled = turned(field, self.ways) * (self.mask[..., None] * self.scale[:, None]).astype(kind)
        mode = np.tensordot(self.axes.T.astype(kind), np.moveaxis(scaled, -3, 0), (1, 0))
        shape = mode.shape
        mode = np.moveaxis(mode, -2, 1).reshape(shape[0], shape[-2], int(np.prod(shape[1:-2])) * shape[-1])
        white = self._known(self.inverse.astype(kind, copy=False) @ mode)
        white = white.reshape(shape[0], shape[-2], *shape[1:-2], shape[-1])
        white = np.moveaxis(np.moveaxis(white, 1, -2), 0, -3)
        return white.reshape(*white.shape[:-3], int(np.prod(white.shape[-3:])))

    @cached_property
    def _there(self) -> DeviceWhitener:
        return DeviceWhitener(self, self.device)

    @cached_property
    def _there_single(self) -> DeviceWhitener:
        return DeviceWhitener(self, self.device, "float32")

    def back(self, white: np.ndarray) -> np.ndarray:
        """The transpose: of numbers (K T 3,), as (K, T, 3)."""
        mode = self._known(white.reshape(len(self.scale), -1, 3).astype(float))
        mode = np.swapaxes(self.inverse, 1, 2) @ mode
        field = np.tensordot(self.axes, mode, (1, 0)) * self.mask[..., None] * self.scale[:, None]
        return turned(field, self.ways, back=True)

    def known(self, white: np.ndarray) -> np.ndarray:
        """Numbers (K T 3, C) less what a constant of each point and unseen samples could be."""
        parts = white.reshape(*self.still.shape, -1)
        return self._known(parts).reshape(white.shape)

    @property
    def free(self) -> int:
        """Degrees of freedom: samples that are seen, less a constant of each point, along three axes."""
        return 3 * int(self.mask.sum() - np.any(self.still, 1).sum())

    def _known(self, white: np.ndarray) -> np.ndarray:
        """Of (M, T, C)."""
        still = self.still.astype(white.dtype)
        white = white - still[:, :, None] * (still[:, None] @ white)
        if not self.lost.shape[1]:
            return white
        flat = white.reshape(len(self.lost), -1)
        lost = self.lost.astype(white.dtype, copy=False)
        return (flat - lost @ (lost.T @ flat)).reshape(white.shape)


def whitener(noise: Noise, rest: np.ndarray, seen: np.ndarray, offsets: bool = True, device: str = "cpu") -> Whitener:
    """For points `rest` [m], (K, 3), seen where `seen`, (K, T); `offsets`: whether each has a constant of its own."""
    axes, shared, camera = noise.modes(rest)
    factor = np.linalg.cholesky(noise.temporal(seen.shape[1], shared, camera))
    inverse = np.linalg.inv(factor)
    still = inverse.sum(-1)
    still = still / np.linalg.norm(still, axis=1, keepdims=True) * offsets
    none = np.zeros((seen.size, 0), np.float32)
    plain = Whitener(1 / noise.scale, axes, inverse, still, seen.astype(float), none, noise.ways, device)
    return replace(plain, lost=_lost(plain, ~seen))


def _lost(plain: Whitener, unseen: np.ndarray) -> np.ndarray:
    """An orthonormal basis of what a value at each unseen sample, (K, T), becomes, (K T, L) float32."""
    k, t = np.nonzero(unseen)
    if not len(k):
        return plain.lost
    columns = np.einsum("lm,mtl->mtl", plain.axes[k], plain.inverse[:, :, t])
    columns = columns - plain.still[:, :, None] * (plain.still[:, None] @ columns)
    columns = columns.reshape(unseen.size, len(k))
    # A point that is never seen has a constant among its unseen samples: what both span counts once.
    gram = columns.T @ columns
    values, vectors = np.linalg.eigh(gram)
    kept = values > 1e-9 * values.max()
    return (columns @ (vectors[:, kept] / np.sqrt(values[kept]))).astype(np.float32)


def modes_of(rest, shared, length, rigid, tilt, forms: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Patterns over points `rest` [m], (K, 3), as orthonormal columns, (K, K), and each one's shared and camera
    variance, (K,).

    forms: where not 0, the first so many span the quadratic forms of place.
    """
    away = ((rest[:, None] - rest[None]) ** 2).sum(-1)
    kernel = shared * np.exp(-0.5 * away / length**2)
    arm = rest - rest.mean(0)
    reach = max(float((arm**2).sum(1).mean()), 1e-12)
    left, size, _ = np.linalg.svd(arm, full_matrices=False)
    size = size**2 * (size > 1e-6 * size.max())
    whole = np.concatenate([np.full((len(rest), 1), len(rest) ** -0.5), left[:, size > 0]], 1)
    # What neighbours share splits into the camera's patterns and the rest; how the two are related is left out.
    basis = np.linalg.qr(whole, mode="complete")[0][:, whole.shape[1] :]
    if forms:
        # Those beside the camera's patterns, which are forms too, come first.
        basis = basis @ np.linalg.svd(basis.T @ quadratic_forms(rest))[0]
    axes, shares = [whole], [np.einsum("km,kl,lm->m", whole, kernel, whole, optimize=True)]
    for beyond in np.split(basis, [max(forms - whole.shape[1], 0)], axis=1):
        values, vectors = np.linalg.eigh(beyond.T @ kernel @ beyond)
        axes.append(beyond @ vectors)
        shares.append(values)
    axes, shares = np.concatenate(axes, 1), np.concatenate(shares)
    camera = np.zeros(len(rest))
    camera[: whole.shape[1]] = np.concatenate([[rigid * len(rest)], tilt * size[size > 0] / reach])
    return axes, np.maximum(shares, 0), camera


def covariance_in_time(frames, shared, camera, keep_shared, keep_rigid, lasting, keep, white) -> np.ndarray:
    """Of patterns with these shared and camera variances, (M,), at `frames`, (T,): (M, T, T)."""
    lag = np.abs(frames[:, None] - frames[None])
    own = lasting * keep**lag + white * np.eye(len(frames))
    return shared[:, None, None] * keep_shared**lag + camera[:, None, None] * keep_rigid**lag + own


def quadratic_forms(rest: np.ndarray) -> np.ndarray:
    """Orthonormal quadratic forms of place, (K, Q), which span the camera's patterns too."""
    arm = (rest - rest.mean(0)) / max(float(np.ptp(rest, axis=0).max()), 1e-9)
    both = [arm[:, i] * arm[:, j] for i in range(3) for j in range(i, 3)]
    left, size, _ = np.linalg.svd(np.column_stack([np.ones(len(rest)), arm, *both]), full_matrices=False)
    return left[:, size > 1e-6 * size.max()]
