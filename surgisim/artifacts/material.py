"""Parameters that vary from particle to particle."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.base import Artifact, check


@dataclass(frozen=True)
class Material(Artifact):
    names: np.ndarray
    """'term.parameter' of each column, in physics.json's units, (M,) str."""
    values: np.ndarray
    """One row a particle of body.npz, (P, M) float32."""

    held: np.ndarray
    """Whether the particle belongs to the boundary that does not move, as the fit found it, (P,) bool."""

    UNITS = {"values": "physics.json's units"}

    def __post_init__(self) -> None:
        check(
            self.values.ndim == 2 and self.values.shape[1] == len(self.names),
            f"Material: values {self.values.shape} must have one column for each of {list(self.names)}.",
        )
        check(self.held.shape == self.values.shape[:1], f"Material: held {self.held.shape} must be (P,).")
        check(bool(np.all(np.isfinite(self.values))), "Material: values must be finite.")
