"""How surely somebody who knows law, base and solver would see what is hidden.

The log evidence of a change d of the paths over nothing is half of |W P d|^2: W divides by the tracking noise, P takes
out what could as well be the base (modulus, Poisson's ratio, viscosity), the timing and firmness of the grips, a
constant error of each point, and the camera where it moves. A ratio of RMS would not compare between points, frames and
families.
"""

import numpy as np

from surgisim.phantom.families.seen import Seeing


def evidence(change: np.ndarray, base: list[np.ndarray], rest: np.ndarray, seen: np.ndarray, seeing: Seeing) -> float:
    """Log evidence [1] of `change` [m], (K, T, 3), where `seen`, (K, T), beside directions `base`, each (K, T, 3).

    rest: where the points sit [m], (K, 3).
    """
    parts = [_projected(d, rest, seen, seeing) for d in (change, *base)]
    mine, others = parts[0], np.stack(parts[1:], 1)
    size = np.linalg.norm(others, axis=0)
    others = others[:, size > 1e-9] / size[size > 1e-9]
    weight = np.linalg.lstsq(others, mine, rcond=1e-8)[0]
    return 0.5 * float(((mine - others @ weight) ** 2).sum()) / seeing.inflation


def _projected(change: np.ndarray, rest: np.ndarray, seen: np.ndarray, seeing: Seeing) -> np.ndarray:
    """Over the noise, without each point's mean and, where the camera moves, without each frame's rigid part; flat."""
    d = np.where(seen[..., None], change / seeing.sigma, 0.0)
    if seeing.camera != "still":
        arm = rest - rest.mean(0)
        turns = [np.cross(np.eye(3)[i], arm) for i in range(3)]
        moves = np.concatenate([np.eye(3)[:, None].repeat(len(rest), 1), np.stack(turns)])
        for t in range(d.shape[1]):
            some = seen[:, t]
            columns = moves[:, some].reshape(6, -1).T
            d[some, t] -= (columns @ np.linalg.lstsq(columns, d[some, t].ravel(), rcond=None)[0]).reshape(-1, 3)
    count = np.maximum(seen.sum(1), 1)[:, None]
    d -= np.where(seen[..., None], (d.sum(1) / count)[:, None], 0.0)
    return d[seen].ravel()
