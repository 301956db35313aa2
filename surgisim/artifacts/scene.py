"""The canonical scene: 3D Gaussians, in the layout every splat viewer reads."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from surgisim.artifacts.base import Artifact, _check_kind, check
from surgisim.artifacts.ply import DC, read_ply, splats, write_ply
from surgisim.problem import Problem


@dataclass(frozen=True)
class Scene(Artifact):
    mean: np.ndarray
    """Centres, camera frame [m], (G, 3) float32."""
    opacity: np.ndarray
    """Logit of the opacity, (G,) float32."""
    scale: np.ndarray
    """Logarithm of the three radii [m], (G, 3) float32."""
    rotation: np.ndarray
    """Unit quaternions w, x, y, z, (G, 4) float32."""
    color: np.ndarray
    """Colour of the constant harmonic, sRGB 0-1, (G, 3) float32."""

    SUFFIX = ".ply"
    UNITS = {"x": "m", "scale_0": "log m", "opacity": "logit"}

    def __post_init__(self) -> None:
        g = len(self.mean)
        shapes = [a.shape for a in (self.mean, self.opacity, self.scale, self.rotation, self.color)]
        check(
            shapes == [(g, 3), (g,), (g, 3), (g, 4), (g, 3)],
            f"Scene: shapes {shapes} do not fit; (G, 3), (G,), (G, 3), (G, 4), (G, 3) are wanted.",
        )

    def encode(self, header: dict[str, Any]) -> bytes:
        return write_ply(splats(self.mean, self.opacity, self.scale, self.rotation, self.color), header)

    @classmethod
    def decode(cls, path: Path) -> tuple[Self, dict[str, Any]]:
        columns, header = read_ply(path)
        if header:
            _check_kind(cls, header, path)
        try:
            return cls(
                mean=_stack(columns, ["x", "y", "z"]),
                opacity=columns["opacity"],
                scale=_stack(columns, [f"scale_{i}" for i in range(3)]),
                rotation=_stack(columns, [f"rot_{i}" for i in range(4)]),
                color=0.5 + DC * _stack(columns, [f"f_dc_{i}" for i in range(3)]),
            ), header
        except KeyError as error:
            raise Problem(f"{path}: has no property {error}, which a splat scene needs.") from error


def _stack(columns: dict[str, np.ndarray], names: list[str]) -> np.ndarray:
    return np.stack([columns[n] for n in names], -1)
