"""How the light of each place of tissue answers to being moved, beyond what its lamp explains.

A lamp, a distance and a normal leave out much of what changes tissue's brightness: walls that shine back, wet folds,
blood pressed out of what is stretched. To first order, whatever the cause,

    log change = the lamp's + w . u / size

u is how far the place has gone; w is smooth over the tissue and drawn to 0 (ridge regression, Hoerl and Kennedy,
Technometrics 1970). How smooth and how strongly is decided by frames left out of the fit, and w is 0 where it does not
tell those better.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates, maximum_filter, minimum_filter

from surgisim.lighting.strength import mildest

SPREADS = (2.0, 1.0, 0.5)
"""Over how much tissue w is smooth, to choose from [grid spacing]."""
RIDGES = (10.0, 1.0, 0.1)
"""How strongly w is drawn to 0, to choose from [frames in which the place has gone `size`]."""
FOLDS = 5
"""Stretches of the recording that are left out in turn."""
OTHER = 1.0
"""Changes beyond which another thing has come into view [log]."""


@dataclass(frozen=True)
class Response:
    """Log brightness that places of the rest picture gain by moving."""

    stride: float
    """Of the lattice [px]."""
    size: float
    """Length of a displacement that counts 1 [m]."""
    weight: np.ndarray
    """Gain a size of displacement, (h, w, 3)."""
    range: np.ndarray
    """The least and the greatest gain seen thereabouts, 0 among them [log], (h, w, 2)."""
    choice: tuple[float, float] | None = None
    """Spread and ridge; None where nothing is gained."""

    @property
    def words(self) -> str:
        if self.choice is None:
            return "nothing that frames left out bear out"
        spread, ridge = self.choice
        return f"by how far each place goes, smooth over {spread:g} cells, ridge {ridge:g}, up to {self.most:.2f}"

    @property
    def most(self) -> float:
        """The largest log gain that was seen."""
        return float(np.abs(self.range).max(initial=0.0))

    def change(self, pixels: np.ndarray, moved: np.ndarray) -> np.ndarray:
        """Log gain, (Q,), of places seen at rest at pixels (Q, 2) that have gone `moved` [m], (Q, 3).

        No place gets brighter or darker than tissue thereabouts was seen to.
        """
        if self.choice is None:
            return np.zeros(len(pixels))
        at = np.asarray(pixels, float)[:, ::-1].T / self.stride
        fields = np.moveaxis(np.concatenate([self.weight, self.range], -1), -1, 0)
        *w, least, greatest = (map_coordinates(field, at, order=1, mode="nearest") for field in fields)
        return np.clip((np.stack(w, 1) * np.asarray(moved, float)).sum(1) / self.size, least, greatest)


def fit_response(
    pixels: np.ndarray, stride: float, cell: float, moved: np.ndarray, left: np.ndarray, seen: np.ndarray
) -> Response:
    """The response that tells stretches of a recording left out of it best.

    pixels: places at rest, on a lattice of that stride through (0, 0) [px], (K, 2); cell: spacing of the grid there
    [px]; moved: how far they have gone in T frames [m], (K, T, 3); left: log change of their brightness that nothing
    else explains, (K, T); seen: where that is known, (K, T) bool.
    """
    known = seen & (np.abs(np.where(seen, left, 0.0)) < OTHER)
    far = np.linalg.norm(moved, axis=-1)
    lattice = np.rint(pixels / stride).astype(int)
    shape = tuple(lattice.max(0, initial=0)[::-1] + 1)
    none = Response(stride, 1.0, np.zeros((*shape, 3)), np.zeros((*shape, 2)))
    size = float(np.sqrt((far[known] ** 2).mean())) if known.any() else 0.0
    if size == 0 or known.shape[1] < FOLDS:
        return none
    u, y = moved / size, np.where(known, left, 0.0)
    row, column = lattice[:, 1], lattice[:, 0]
    fold = np.arange(known.shape[1]) * FOLDS // known.shape[1]
    moments = [_moments(u, y, known & (fold == f)) for f in range(FOLDS)]

    def weight(kept: list[int], spread: float, ridge: float) -> np.ndarray:
        fields = [np.zeros((*shape, *m.shape[1:])) for m in moments[0]]
        for f in kept:
            for field, m in zip(fields, moments[f], strict=True):
                field[row, column] += m
        width = spread * cell / stride
        square, product = (gaussian_filter(f, width, axes=(0, 1), mode="constant") for f in fields)
        count = np.zeros(shape)
        count[row, column] = 1.0
        # Where the lattice ends, what is known counts as much as elsewhere.
        full = np.maximum(gaussian_filter(count, width, mode="constant"), 1e-3)
        square, product = square / full[..., None, None], product / full[..., None]
        return np.linalg.solve(square + ridge * np.eye(3), product[..., None])[..., 0]

    choices = [None, *itertools.product(SPREADS, RIDGES)]
    error = np.zeros((len(choices), FOLDS))
    for f in range(FOLDS):
        out = known & (fold == f)
        error[0, f] = (y[out] ** 2).sum()
        for n, choice in enumerate(choices[1:], 1):
            w = weight([g for g in range(FOLDS) if g != f], *choice)[row, column]
            error[n, f] = ((y - np.einsum("kd,ktd->kt", w, u))[out] ** 2).sum()
    chosen = choices[mildest(tuple(range(len(choices))), error)]
    if chosen is None:
        return none
    told = np.einsum("kd,ktd->kt", weight(list(range(FOLDS)), *chosen)[row, column], u)
    span = np.zeros((*shape, 2))
    span[row, column] = np.stack([np.where(known, told, 0.0).min(1), np.where(known, told, 0.0).max(1)], -1)
    around = 2 * int(np.ceil(chosen[0] * cell / stride)) + 1
    span = np.stack([minimum_filter(span[..., 0], around), maximum_filter(span[..., 1], around)], -1)
    return Response(stride, size, weight(list(range(FOLDS)), *chosen), span, chosen)


def _moments(u: np.ndarray, y: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sums over frames of u u^T, (K, 3, 3), and u y, (K, 3), where known, (K, T)."""
    mine = u * known[..., None]
    return np.einsum("ktd,kte->kde", mine, u), np.einsum("ktd,kt->kd", mine, y)
