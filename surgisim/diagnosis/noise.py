"""The tracks' noise: how large, how alike among neighbours, how lasting; and the whitening that follows from it.

An axis of the error of point k at frame t is modelled as

    d_k a_k [ shared(x, t) + camera(x, t) + lasting_k(t) + white_k(t) ]

a_k: that axis over all three of the point, 1 where they are alike; of a clip depth is less sure than what lies across
the view. shared: c exp(-|x - x'|^2 / 2 l^2), in time rho^|t - t'|; camera: a constant and a gradient over the tissue,
which shake from frame to frame, in time s^|t - t'|; lasting: a r^|t - t'|; white: b. The numbers are those of largest
restricted likelihood on frames in which the tissue is still, each stretch less its own polynomial in time, so that what
physics moves slowly is not counted as noise (Patterson and Thompson, Recovery of inter-block information when block
sizes are unequal, Biometrika 58, 1971). Such polynomials hide noise that lasts, too, and what nothing tells is at its
prior's middle. So less is taken off of frames in which nothing has touched the tissue yet: there it does not relax, and
what moves each place otherwise than its surroundings is the tracker. Patterns over the points (constant, gradients,
then the eigenvectors of what is shared) are each a time series of their own, which a Cholesky factor whitens.

What is not seen has no value: every sample that is missing is a direction of infinite variance, and so is each point's
constant. Projecting those out of the whitened vectors is the exact marginal likelihood of the samples that are there.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.polynomial.legendre import legvander
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from surgisim.recordings.ways import told_of, turned

MOST_POINTS, FEWER = 90, 45
"""Points whose covariance is fitted, and where samples are missing; all are whitened."""
SLOW, SLOW_AT_REST = 4, 16
"""Frames for each degree of the polynomial that is taken off a stretch; of what neighbours do otherwise than all while
nothing has touched the tissue yet."""
STRETCH = 24
"""Frames of a stretch where no frames are known to be still."""
SEEN = 0.6
"""Share of a stretch in which a point must be seen to tell of the noise there."""
MOST_RUNS = 400
"""Likelihoods computed at most for a fit."""
PARTS = ("shared", "rigid", "tilt", "lasting", "white")
"""Variances of a `Noise`."""
TOGETHER = 6
"""Patterns over the points, those of all other frames, that a frame may share; what it has beside them is its own."""
FILLINGS = 3
"""How often missing samples are drawn anew and the numbers fitted again, where samples are missing."""


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
        return _modes(rest, self.shared, self.length, self.rigid, self.tilt)

    def temporal(self, frames: int, shared: np.ndarray, camera: np.ndarray) -> np.ndarray:
        """Covariance in time of every pattern, (M, T, T)."""
        found = _temporal(
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

    def __call__(self, field: np.ndarray) -> np.ndarray:
        """Of fields [m], (..., K, T, 3), as (..., K T 3), in their own precision."""
        kind = np.float32 if field.dtype == np.float32 else float
        scaled = turned(field, self.ways) * (self.mask[..., None] * self.scale[:, None]).astype(kind)
        mode = np.tensordot(self.axes.T.astype(kind), np.moveaxis(scaled, -3, 0), (1, 0))
        shape = mode.shape
        mode = np.moveaxis(mode, -2, 1).reshape(shape[0], shape[-2], int(np.prod(shape[1:-2])) * shape[-1])
        white = self._known(self.inverse.astype(kind, copy=False) @ mode)
        white = white.reshape(shape[0], shape[-2], *shape[1:-2], shape[-1])
        white = np.moveaxis(np.moveaxis(white, 1, -2), 0, -3)
        return white.reshape(*white.shape[:-3], int(np.prod(white.shape[-3:])))

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


def whitener(noise: Noise, rest: np.ndarray, seen: np.ndarray, offsets: bool = True) -> Whitener:
    """For points `rest` [m], (K, 3), seen where `seen`, (K, T); `offsets`: whether each has a constant of its own."""
    axes, shared, camera = noise.modes(rest)
    factor = np.linalg.cholesky(noise.temporal(seen.shape[1], shared, camera))
    inverse = np.linalg.inv(factor)
    still = inverse.sum(-1)
    still = still / np.linalg.norm(still, axis=1, keepdims=True) * offsets
    none = np.zeros((seen.size, 0), np.float32)
    plain = Whitener(1 / noise.scale, axes, inverse, still, seen.astype(float), none, noise.ways)
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


def estimate(
    moved: np.ndarray, seen: np.ndarray, rest: np.ndarray, still: np.ndarray, nominal: np.ndarray,
    axes: np.ndarray | None = None, ways: np.ndarray | None = None, untouched: int | None = None,
) -> Noise:  # fmt: skip
    """From displacements [m], (K, T, 3), where `seen`, (K, T), on frames that are `still`, (T,) bool.

    nominal: what the recording says of each point's noise [m], (K,); it decides where nothing can be estimated.
    axes: what it says of the three axes' shares of it [1], (K, 3), None if alike; ways: their directions, (K, 3, 3),
    if not x, y and z. untouched: first frame in which something grips; None where tracks are a video's, which go astray
    with tissue that moves by itself.
    Missing samples of a stretch are drawn from what the seen ones leave open, and the numbers fitted again.
    """
    if axes is not None:
        found = estimate(turned(moved, ways) / axes[:, None], seen, rest, still, nominal, untouched=untouched)
        return replace(found, axes=axes, ways=ways)
    level = np.maximum(_levels(moved, seen, nominal), 1e-9)
    rng = np.random.default_rng(0)
    most = MOST_POINTS if seen[:, still].all() else FEWER
    chosen = np.arange(len(rest)) if len(rest) <= most else np.sort(rng.permutation(len(rest))[:most])
    parts = []
    for frames in _stretches(still, untouched or 0):
        mine = chosen[seen[np.ix_(chosen, frames)].mean(1) >= SEEN]
        if len(mine) >= 4:
            parts.append(_Stretch.of(moved, seen, rest, level, mine, frames, frames[-1] < (untouched or 0)))
    prior = PRIOR if untouched is None else MEASURED
    noise = Noise(level, **_unpacked(prior[0]))
    if not parts:
        return noise
    gaps = any(not part.seen.all() for part in parts)
    x = prior[0]
    for _ in range(FILLINGS if gaps else 1):
        filled = [part.filled(noise, rng) for part in parts]
        x = _fitted(filled, x, MOST_RUNS, prior)
        noise = Noise(level, **_unpacked(x))
    return noise


def by_frame(noise: Noise, moved: np.ndarray, seen: np.ndarray) -> Noise:
    """With what each frame adds to it, as displacements [m], (K, T, 3), where `seen`, (K, T), show in no other frame.

    Frames in which tissue moves are blurred, and followed less well than those that tell of the noise.
    """
    sure = noise.scale.argsort(1, kind="stable")[:, : 3 if noise.axes is None else 2]
    along = np.take_along_axis(turned(moved, noise.ways) / noise.scale[:, None], sure[:, None], 2)
    frames = np.arange(moved.shape[1])
    rows = np.array(
        [np.interp(frames, frames[s], p[s, a]) for p, s in zip(along, seen, strict=True) for a in range(p.shape[1])]
    )
    counted, variance = np.repeat(seen, sure.shape[1], axis=0), np.zeros(len(frames))
    for t in frames:
        shared = np.linalg.svd(np.delete(rows, t, axis=1), full_matrices=False)[0][:, :TOGETHER]
        own = rows[:, t] - shared @ (shared.T @ rows[:, t])
        variance[t] = (own**2)[counted[:, t]].sum() / max(counted[:, t].sum() - shared.shape[1], 1)
    return replace(noise, rough=np.maximum(variance - sum(getattr(noise, name) for name in PARTS), 0.0))


@dataclass(frozen=True)
class _Stretch:
    """Successive frames of some points, over their levels."""

    rest: np.ndarray
    """(K, 3)"""
    seen: np.ndarray
    """(K, T)"""
    value: np.ndarray
    """(K, T, 3), of seen samples."""
    slow: np.ndarray
    """Polynomials in time, (T, B)."""
    slow_here: np.ndarray
    """Those of what neighbours do otherwise than all, (T, A)."""

    @classmethod
    def of(cls, moved, seen, rest, level, mine, frames, untouched) -> "_Stretch":
        time, at = np.linspace(-1, 1, len(frames)), np.ix_(mine, frames)
        slow, here = (legvander(time, max(1, len(frames) // each)) for each in (SLOW, SLOW_AT_REST))
        return cls(rest[mine], seen[at], moved[at] / level[mine, None, None], slow, here if untouched else slow)

    def filled(self, noise: Noise, rng: np.random.Generator) -> "_Filled":
        value = self._completed(noise, rng) if not self.seen.all() else self.value
        forms = _quadratic(self.rest).shape[1]
        return _Filled(self.rest, forms, (_contrasts(self.slow), _contrasts(self.slow_here)), value)

    def _completed(self, noise: Noise, rng: np.random.Generator) -> np.ndarray:
        """Values with those that are missing drawn from what the seen ones leave open (kriging with a trend)."""
        axes, shared, camera = noise.modes(self.rest)
        cov = np.einsum("km,mts,lm->ktls", axes, noise.temporal(len(self.slow), shared, camera), axes, optimize=True)
        size = self.seen.size
        # A trend of each point, as uncertain as anything that moves slowly.
        trend = 30.0**2 * self.slow_here @ self.slow_here.T
        cov = cov.reshape(size, size) + np.kron(np.eye(len(self.rest)), trend)
        there, gone = np.flatnonzero(self.seen), np.flatnonzero(~self.seen)
        factor = cho_factor(cov[np.ix_(there, there)])
        weight = cho_solve(factor, cov[np.ix_(there, gone)]).T
        rest = cov[np.ix_(gone, gone)] - weight @ cov[np.ix_(there, gone)]
        values, vectors = np.linalg.eigh(0.5 * (rest + rest.T))
        spread = vectors * np.sqrt(np.maximum(values, 0))
        flat = self.value.reshape(size, 3).copy()
        flat[gone] = weight @ flat[there] + spread @ rng.standard_normal((len(gone), 3))
        return flat.reshape(self.value.shape)


@dataclass(frozen=True)
class _Filled:
    """The same with every sample there."""

    rest: np.ndarray
    forms: int
    """How many of the modes are quadratic forms of place."""
    parts: tuple[np.ndarray, np.ndarray]
    """Contrasts in time that no polynomial changes of those modes and of all others, (T, C)."""
    value: np.ndarray

    def cost(self, part: dict[str, float]) -> float:
        """Minus the logarithm of the restricted likelihood."""
        axes, shared, camera = _modes(
            self.rest, part["shared"], part["length"], part["rigid"], part["tilt"], self.forms
        )
        keeps, total = [part[name] for name in ("keep_shared", "keep_rigid", "lasting", "keep", "white")], 0.0
        for mine, basis in zip((slice(0, self.forms), slice(self.forms, None)), self.parts, strict=True):
            cov = basis.T @ _temporal(np.arange(len(basis)), shared[mine], camera[mine], *keeps) @ basis
            factor = np.linalg.cholesky(cov)
            mode = np.einsum("km,ts,ktc->msc", axes[:, mine], basis, self.value, optimize=True)
            white = np.linalg.solve(factor, mode)
            total += 0.5 * float((white**2).sum()) + 3 * float(np.log(np.diagonal(factor, axis1=1, axis2=2)).sum())
        return total


def _contrasts(slow: np.ndarray) -> np.ndarray:
    return np.linalg.qr(slow, mode="complete")[0][:, slow.shape[1] :]


def _quadratic(rest: np.ndarray) -> np.ndarray:
    """Orthonormal quadratic forms of place, (K, Q), which span the camera's patterns too."""
    arm = (rest - rest.mean(0)) / max(float(np.ptp(rest, axis=0).max()), 1e-9)
    both = [arm[:, i] * arm[:, j] for i in range(3) for j in range(i, 3)]
    left, size, _ = np.linalg.svd(np.column_stack([np.ones(len(rest)), arm, *both]), full_matrices=False)
    return left[:, size > 1e-6 * size.max()]


def _fitted(data: list[_Filled], x: np.ndarray, most: int, prior: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Numbers of largest restricted likelihood, times the prior's, from x."""

    def cost(x: np.ndarray) -> float:
        part = _unpacked(x)
        return 0.5 * float((((x - prior[0]) / prior[1]) ** 2).sum()) + sum(each.cost(part) for each in data)

    return minimize(cost, x, method="L-BFGS-B", options={"maxfun": most, "ftol": 1e-7, "eps": 1e-4}).x


PRIOR = (
    np.array([-1.2, np.log(0.006), -3.0, -3.0, 1.0, 0.0, -1.2, 1.0, -0.8]),
    np.array([1.5, 0.6, 1.5, 1.5, 1.0, 1.0, 1.5, 1.0, 1.5]),
)
"""Middle and spread of: log shared, log length [m], log rigid, log tilt, logit rho, logit s, log lasting, logit r, log
white.
Wide: a factor of four and more either way, correlations of .3 to .9; what no still frames tell is at its middle."""
MEASURED = (
    np.array([-2.5, np.log(0.006), -3.0, -3.0, 1.0, 0.0, -2.5, 1.0, -0.8]),
    np.array([2.5, 0.6, 2.5, 2.5, 1.0, 1.0, 2.5, 1.0, 1.5]),
)
"""The same of what markers or another kept tracker measure: noise may well be white."""


def _unpacked(x: np.ndarray) -> dict[str, float]:
    e, s = np.exp(np.clip(x, -12, 6)), 0.97 / (1 + np.exp(-x))
    return {
        "shared": e[0], "length": e[1], "rigid": e[2], "tilt": e[3], "keep_shared": s[4], "keep_rigid": s[5],
        "lasting": e[6], "keep": s[7], "white": e[8] + 1e-3,
    }  # fmt: skip


def _modes(rest, shared, length, rigid, tilt, forms: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """forms: where not 0, the first so many modes span the quadratic forms of place."""
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
        basis = basis @ np.linalg.svd(basis.T @ _quadratic(rest))[0]
    axes, shares = [whole], [np.einsum("km,kl,lm->m", whole, kernel, whole, optimize=True)]
    for beyond in np.split(basis, [max(forms - whole.shape[1], 0)], axis=1):
        values, vectors = np.linalg.eigh(beyond.T @ kernel @ beyond)
        axes.append(beyond @ vectors)
        shares.append(values)
    axes, shares = np.concatenate(axes, 1), np.concatenate(shares)
    camera = np.zeros(len(rest))
    camera[: whole.shape[1]] = np.concatenate([[rigid * len(rest)], tilt * size[size > 0] / reach])
    return axes, np.maximum(shares, 0), camera


def _temporal(frames, shared, camera, keep_shared, keep_rigid, lasting, keep, white) -> np.ndarray:
    lag = np.abs(frames[:, None] - frames[None])
    own = lasting * keep**lag + white * np.eye(len(frames))
    return shared[:, None, None] * keep_shared**lag + camera[:, None, None] * keep_rigid**lag + own


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


def _stretches(still: np.ndarray, touched: int) -> list[np.ndarray]:
    """Successive frames, of which none holds the first frame that is touched beside others before it."""
    frames = np.flatnonzero(still)
    apart = (np.diff(frames) > 1) | ((frames[:-1] < touched) & (frames[1:] >= touched))
    parts = [p for p in np.split(frames, np.flatnonzero(apart) + 1) if len(p) >= 6]
    if not parts:
        parts = np.array_split(np.arange(len(still)), max(1, len(still) // STRETCH))
    return [q for p in parts for q in np.array_split(p, max(1, len(p) // (2 * STRETCH)))]
