"""The noise of tracks, from frames in which the tissue is still.

Its numbers are those of largest restricted likelihood there, each stretch of frames less its own polynomial in time, so
that what physics moves slowly is not counted as noise (Patterson and Thompson, Recovery of inter-block information when
block sizes are unequal, Biometrika 58, 1971). Such polynomials hide noise that lasts, too, and what nothing tells is at
its prior's middle. So less is taken off of frames in which nothing has touched the tissue yet: there it does not relax,
and what moves each place otherwise than its surroundings is the tracker.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial.legendre import legvander
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from surgisim.diagnosis.noise import PARTS, Noise, covariance_in_time, modes_of, quadratic_forms
from surgisim.recordings.ways import turned

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
TOGETHER = 6
"""Patterns over the points, those of all other frames, that a frame may share; what it has beside them is its own."""
FILLINGS = 3
"""How often missing samples are drawn anew and the numbers fitted again, where samples are missing."""
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
        forms = quadratic_forms(self.rest).shape[1]
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
        axes, shared, camera = modes_of(
            self.rest, part["shared"], part["length"], part["rigid"], part["tilt"], self.forms
        )
        keeps, total = [part[name] for name in ("keep_shared", "keep_rigid", "lasting", "keep", "white")], 0.0
        for mine, basis in zip((slice(0, self.forms), slice(self.forms, None)), self.parts, strict=True):
            cov = basis.T @ covariance_in_time(np.arange(len(basis)), shared[mine], camera[mine], *keeps) @ basis
            factor = np.linalg.cholesky(cov)
            mode = np.einsum("km,ts,ktc->msc", axes[:, mine], basis, self.value, optimize=True)
            white = np.linalg.solve(factor, mode)
            total += 0.5 * float((white**2).sum()) + 3 * float(np.log(np.diagonal(factor, axis1=1, axis2=2)).sum())
        return total


def _contrasts(slow: np.ndarray) -> np.ndarray:
    return np.linalg.qr(slow, mode="complete")[0][:, slow.shape[1] :]


def _fitted(data: list[_Filled], x: np.ndarray, most: int, prior: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Numbers of largest restricted likelihood, times the prior's, from x."""

    def cost(x: np.ndarray) -> float:
        part = _unpacked(x)
        return 0.5 * float((((x - prior[0]) / prior[1]) ** 2).sum()) + sum(each.cost(part) for each in data)

    return minimize(cost, x, method="L-BFGS-B", options={"maxfun": most, "ftol": 1e-7, "eps": 1e-4}).x


def _unpacked(x: np.ndarray) -> dict[str, float]:
    e, s = np.exp(np.clip(x, -12, 6)), 0.97 / (1 + np.exp(-x))
    return {
        "shared": e[0], "length": e[1], "rigid": e[2], "tilt": e[3], "keep_shared": s[4], "keep_rigid": s[5],
        "lasting": e[6], "keep": s[7], "white": e[8] + 1e-3,
    }  # fmt: skip


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
