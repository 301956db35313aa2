"""Forces that were measured beside the points: forces.npz of a recording folder.

force       (J, T, 3) of each grip on the tissue, in the recording's frame [N]; NaN where it is not known
sigma       (J,) noise of its components [N]
held        optional (1, T, 3) of what is held (fixed.json) on the tissue, as a load cell below it measures [N]
held_sigma  (1,) its noise [N]

All less what they are at rest: the tissue's own weight is in none of them. Newtons, whatever 'length_unit' is.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from surgisim.artifacts.base import check
from surgisim.problem import Problem
from surgisim.recordings.arrays import arrays

LARGEST = 1e3
"""Beyond which a force is no longer one on tissue [N]."""


@dataclass(frozen=True)
class Forces:
    force: np.ndarray
    """Of each grip on the tissue [N], (J, T, 3), NaN where it is not known."""
    sigma: np.ndarray
    """(J,) [N]"""
    held: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 3)))
    """Of what is held [N], (1, T, 3), or none."""
    held_sigma: np.ndarray = field(default_factory=lambda: np.zeros(0))
    """(1,) or none [N]."""

    def __post_init__(self) -> None:
        check(
            self.force.ndim == 3 and self.force.shape[::2] == (len(self.sigma), 3),
            f"forces: {self.force.shape} with sigma {self.sigma.shape}; (J, T, 3) and (J,) are wanted.",
        )

    def of_anchors(self, frames: int) -> tuple[np.ndarray, np.ndarray]:
        """Of what is held, then of the grips [N], (1 + J, T, 3), NaN where not known, and their noise, (1 + J,)."""
        held = self.held if len(self.held) else np.full((1, frames, 3), np.nan)
        sigma = self.held_sigma if len(self.held_sigma) else np.ones(1)
        return np.concatenate([held, self.force]), np.concatenate([sigma, self.sigma])


def read_forces(path: Path, frames: int, grips: int) -> Forces | None:
    """None where there is no such file. Raises Problem for what could be misread."""
    if not path.is_file():
        return None
    shapes = {"force": "JT3", "sigma": "J", "held": "HT3", "held_sigma": "H"}
    found = {n: a.astype(float) for n, a in arrays(path, shapes, frames, ("held", "held_sigma")).items()}
    if len(found["force"]) != grips:
        raise Problem(
            f"{path}: 'force' is of {len(found['force'])} grips, but grip.npz has {grips}. Give each grip's, NaN where "
            "it is not known."
        )
    if ("held" in found) != ("held_sigma" in found) or len(found.get("held", [0])) != 1:
        raise Problem(f"{path}: 'held' is (1, T, 3) and 'held_sigma' (1,). Give both, or neither.")
    for name in ("force", "held"):
        sigma = found.get("sigma" if name == "force" else "held_sigma", np.ones(1))
        if not (np.isfinite(sigma) & (sigma > 0)).all():
            raise Problem(
                f"{path}: the noise of '{name}' is {sigma.tolist()}, but numbers above 0 are wanted. Give it."
            )
        largest = np.abs(found[name][np.isfinite(found[name])]).max(initial=0.0) if name in found else 0.0
        if largest > LARGEST:
            raise Problem(
                f"{path}: '{name}' reaches {largest:.3g} N, and beyond {LARGEST:g} N no tissue is pulled. Is it in "
                "another unit? Newtons are wanted."
            )
    known = [np.isfinite(found[name]).any() for name in ("force", "held") if name in found]
    if not any(known):
        raise Problem(f"{path}: no force is a number. Leave the file out, or give some.")
    return Forces(**found)


def encoded_forces(forces: Forces) -> dict[str, np.ndarray]:
    """The arrays of forces.npz by name."""
    told = {"force": forces.force, "sigma": forces.sigma}
    return told | ({"held": forces.held, "held_sigma": forces.held_sigma} if len(forces.held) else {})
