"""The shading of a surface lit from the camera, and the depth that explains a given one."""

from dataclasses import dataclass
from typing import Self

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from surgisim.artifacts.camera import Camera
from surgisim.perception.flow import pixel_grid

STEPS = 4
"""Gauss-Newton steps at most; it begins close."""


@dataclass(frozen=True)
class Lattice:
    """A coarse image grid, its rays and its differences."""

    shape: tuple[int, int]
    pixels: np.ndarray
    """[lattice px], (h, w, 2)."""
    ray: np.ndarray
    """X and Y of (X, Y, 1), (h, w, 2)."""
    along_x: sp.csr_matrix
    """d/dX of a flat field."""
    along_y: sp.csr_matrix
    bend: sp.csr_matrix
    """Second differences, (.., h w) [1 / longer side^2]."""

    @classmethod
    def of(cls, camera: Camera, ratio: float) -> Self:
        high, wide = max(round(camera.height * ratio), 8), max(round(camera.width * ratio), 8)
        pixels = pixel_grid(high, wide)
        source = (pixels + 0.5) * np.array([camera.width / wide, camera.height / high]) - 0.5
        ray = (source - [camera.cx, camera.cy]) / [camera.fx, camera.fy]
        one_x, one_y = sp.identity(wide), sp.identity(high)
        step_x = camera.width / wide / camera.fx
        step_y = camera.height / high / camera.fy
        unit = max(high, wide) ** 2
        twist = sp.kron(_forward(high), _forward(wide)) * np.sqrt(2.0)
        bend = sp.vstack([sp.kron(one_y, _second(wide)), sp.kron(_second(high), one_x), twist]) * unit
        return cls(
            (high, wide),
            pixels,
            ray,
            (sp.kron(one_y, _central(wide)) / step_x).tocsr(),
            (sp.kron(_central(high), one_x) / step_y).tocsr(),
            bend.tocsr(),
        )


def shading(lattice: Lattice, log_z: np.ndarray) -> np.ndarray:
    """How many natural logarithms darker than its albedo a surface of log depth (h, w) looks, (h, w)."""
    return _shading(lattice, log_z.ravel())[0].reshape(lattice.shape)


def explain(
    lattice: Lattice,
    light: np.ndarray,
    weight: np.ndarray,
    prior: np.ndarray,
    *,
    spread_of_data: float,
    spread_of_shape: float | np.ndarray,
    finest: float,
    smooth_about: np.ndarray | None = None,
    begin: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Log depth (h, w) whose shading turns albedo 1 into `light` (h, w), and what it leaves unexplained (h, w).

    weight: share of each pixel to believe, (h, w). prior: expected log depth, held to within `spread_of_shape`, one
    number or (h, w). Light is held to within `spread_of_data`, outliers counting less. Waves of the difference from
    `smooth_about` (0) shorter than `finest` longer sides are smoothed away.
    """
    level = prior.ravel()
    base = np.zeros_like(level) if smooth_about is None else smooth_about.ravel()
    log_z = (prior if begin is None else begin).ravel().astype(float)
    stiffness = (finest / (2 * np.pi)) ** 4 * 4 / spread_of_data**2
    held = np.broadcast_to(1 / np.square(spread_of_shape), lattice.shape).ravel()
    fixed = stiffness * (lattice.bend.T @ lattice.bend) + sp.diags(held)
    pull = held * level + stiffness * (lattice.bend.T @ (lattice.bend @ base))
    for _ in range(STEPS):
        dark, slope = _shading(lattice, log_z)
        rest = light.ravel() + dark
        robust = weight.ravel() / spread_of_data**2 / np.maximum(1.0, np.abs(rest) / (2 * spread_of_data))
        heavy = slope.T @ sp.diags(robust)
        # The matrix is symmetric, and eliminated in an order for such ones in two thirds of the time.
        step = spsolve((fixed + heavy @ slope).tocsc(), pull - fixed @ log_z - heavy @ rest, permc_spec="MMD_AT_PLUS_A")
        log_z = log_z + step
        if np.abs(step).max() < 1e-3:
            break
    rest = light.ravel() + _shading(lattice, log_z)[0]
    return log_z.reshape(lattice.shape), (rest * (weight.ravel() > 0)).reshape(lattice.shape)


def _shading(lattice: Lattice, log_z: np.ndarray) -> tuple[np.ndarray, sp.csr_matrix]:
    """The flat shading and its derivative with respect to flat log depth."""
    x, y = lattice.ray.reshape(-1, 2).T
    wx, wy = lattice.along_x @ log_z, lattice.along_y @ log_z
    facing = 1 + x * wx + y * wy
    steep = wx**2 + wy**2 + facing**2
    dark = 2 * log_z + 1.5 * np.log(x**2 + y**2 + 1) + 0.5 * np.log(steep)
    slope = (
        2 * sp.identity(log_z.size)
        + sp.diags((wx + x * facing) / steep) @ lattice.along_x
        + sp.diags((wy + y * facing) / steep) @ lattice.along_y
    )
    return dark, slope.tocsr()


def _central(n: int) -> sp.csr_matrix:
    d = sp.diags([-0.5, 0.5], [-1, 1], shape=(n, n)).tolil()
    d[0, :2] = d[-1, -2:] = [-1, 1]
    return d.tocsr()


def _forward(n: int) -> sp.csr_matrix:
    return sp.diags([-1.0, 1.0], [0, 1], shape=(n - 1, n)).tocsr()


def _second(n: int) -> sp.csr_matrix:
    return sp.diags([1.0, -2.0, 1.0], [0, 1, 2], shape=(n - 2, n)).tocsr()
