"""How the surface of a soft layer moves when a ball of its tissue is carried off.

A layer of linear elastic tissue is fixed to a base and free on top. Jaws hold a half-ball of tissue, within one radius
of a point of its surface, and carry it without turning it. Displacements are a fixed field times how far it is carried,
whatever the modulus. Along the layer the field is a sum of waves (fast Fourier transform, in a periodic box many radii
wide); through its thickness each wave is a column of linear elements, integrated at their middles so that nearly
incompressible tissue does not lock. The forces in the half-ball are those that carry all of it alike.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from surgisim.perception.tracking.between import sample

POISSON = 0.45
"""Of soft tissue."""
THICKNESSES = (1.25, 1.75, 2.75, 4.0, 6.0)
"""That fields are solved for, those between interpolated [radii]."""
CELLS, WIDTH = 4, 96
"""Grid cells a radius; along a side of the box."""
KNOTS = 160
"""Wave numbers that columns are solved for, those between interpolated."""


@dataclass(frozen=True)
class SoftLayer:
    """Fields of every thickness, solved once."""

    fields: np.ndarray
    """Surface displacement along x, along y and out of the tissue, each by a unit of carrying along the same three,
    (thicknesses, WIDTH, WIDTH, 3 x 3) float32."""

    @classmethod
    def solved(cls) -> Self:
        return cls(np.stack([_half_ball(t).reshape(WIDTH, WIDTH, 9) for t in THICKNESSES]).astype(np.float32))

    def carried(self, at: np.ndarray, thickness: float) -> np.ndarray:
        """Displacement (K, 3) by each unit of carrying, (K, 3, 3), of surface points `at` (K, 2) from the centre.

        at: along the layer [radii]; thickness [radii], the nearest of those solved for where it is beyond them.
        """
        place = np.interp(np.log(thickness), np.log(THICKNESSES), np.arange(len(THICKNESSES)))
        thinner = min(int(place), len(THICKNESSES) - 2)
        share = np.float32(place - thinner)
        field = (1 - share) * self.fields[thinner] + share * self.fields[thinner + 1]
        return sample(field, at * CELLS + WIDTH // 2).reshape(-1, 3, 3).astype(float)


def _half_ball(thickness: float) -> np.ndarray:
    """Field of one thickness [radii], (WIDTH, WIDTH, 3, 3)."""
    wave = 2 * np.pi * np.fft.fftfreq(WIDTH, 1 / CELLS)
    down, right = np.meshgrid(wave, wave, indexing="ij")
    size = np.hypot(right, down)
    knots = np.linspace(0, size.max(), KNOTS)
    columns = _columns(knots, round(thickness * CELLS))[:, : CELLS + 1, :, : CELLS + 1]
    below = np.minimum((size / knots[1]).astype(int), KNOTS - 2)
    share = (size / knots[1] - below)[..., None, None, None, None]
    compliance = (1 - share) * columns[below] + share * columns[below + 1]
    x, y = right / np.maximum(size, 1e-9), down / np.maximum(size, 1e-9)
    zero, one = np.zeros_like(x), np.ones_like(x)
    # Along the wave, across it and out of the layer; the first leads the last by a quarter of a wave.
    turn = np.array([[1j * x, -y, zero], [1j * y, x, zero], [zero, zero, one]]).transpose(2, 3, 0, 1)
    turn[0, 0] = np.eye(3)
    greens = np.einsum("yxab,yxlbmc,yxdc->lmadyx", turn, compliance, turn.conj(), optimize=True)
    level, row, column = _nodes()
    pairs = np.fft.ifft2(greens).real[
        level[:, None], level, :, :, (row[:, None] - row) % WIDTH, (column[:, None] - column) % WIDTH
    ]
    count = len(level)
    stiff = pairs.transpose(0, 2, 1, 3).reshape(3 * count, 3 * count)
    force = np.zeros((CELLS + 1, 3, 3, WIDTH, WIDTH))
    force[level, :, :, row, column] = np.linalg.solve(stiff, np.tile(np.eye(3), (count, 1))).reshape(count, 3, 3)
    moved = np.einsum("madyx,mdcyx->acyx", greens[0], np.fft.fft2(force), optimize=True)
    return np.fft.ifft2(moved).real.transpose(2, 3, 0, 1)


def _nodes() -> tuple[np.ndarray, ...]:
    """Level below the surface, row and column of every grid node in the half-ball."""
    reach = np.arange(WIDTH) - WIDTH // 2
    level, row, column = np.meshgrid(np.arange(CELLS + 1), reach, reach, indexing="ij")
    return np.nonzero(level**2 + row**2 + column**2 <= CELLS**2)


def _columns(wave: np.ndarray, elements: int) -> np.ndarray:
    """Displacement at every level by a force at every level, from the top, (waves, levels, 3, levels, 3).

    wave: wave numbers [1 / radius]. Shear modulus 1.
    """
    step, zero, one = 1 / CELLS, np.zeros_like(wave), np.ones_like(wave)
    mean, slope = (0.5 * wave, 0.5 * wave), (one / step, -one / step)

    def row(along=(zero, zero), across=(zero, zero), out=(zero, zero)) -> np.ndarray:
        return np.stack([along[0], across[0], out[0], along[1], across[1], out[1]], -1)

    less = (-mean[0], -mean[1])
    strains = [
        (2 * POISSON / (1 - 2 * POISSON), row(along=less, out=slope)),
        (2.0, row(along=less)),
        (2.0, row(out=slope)),
        (1.0, row(along=slope, out=mean)),
        (1.0, row(across=mean)),
        (1.0, row(across=slope)),
    ]
    element = step * sum(stiff * strain[:, :, None] * strain[:, None] for stiff, strain in strains)
    whole = np.zeros((len(wave), 3 * elements + 3, 3 * elements + 3))
    for e in range(elements):
        whole[:, 3 * e : 3 * e + 6, 3 * e : 3 * e + 6] += element
    # The lowest level is the base.
    return np.linalg.inv(whole[:, :-3, :-3]).reshape(len(wave), elements, 3, elements, 3)
