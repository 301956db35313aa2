"""What a simulation is compared with: tracked points of the surface, weighted by their noise."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy import sparse

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.frames import USED
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.tracks import Tracks
from surgisim.estimation.brightness import Brightness
from surgisim.mpm.simulator import Simulator
from surgisim.problem import Problem

PHASES = ("rest", "load", "hold", "release")
MEASURED = 0.05
"""Depth's change counts where its standard deviation is below this share of the depth: a guess is no observation."""


@dataclass(frozen=True)
class Observation:
    """Displacements of K surface points in space."""

    rest: np.ndarray
    """Their positions in frame 0 [m], (K, 3)."""
    displacement: np.ndarray
    """Since frame 0 [m], (K, T, 3), zero where not seen."""
    weight: np.ndarray
    """1 / standard deviation of each component [1/m], (K, T, 3), zero where not seen or not to be used."""
    carry: sparse.csr_matrix
    """Active nodes to points, (K, A)."""

    light = None
    """Points in space have no brightness; a film's have."""

    def carried_by(self, simulator: Simulator) -> Self:
        """The same points on another grid."""
        return replace(self, carry=simulator.carry(self.rest).tocsr())

    def residual(self, u: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Weighted difference, simulated minus seen, at `frames`, (K, len(frames), 3); u is (T, A, 3)."""
        return self.weight[:, frames] * self.apart(self._simulated(u, frames), frames)

    def pulled_back(self, bar: np.ndarray, u: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """The derivative by u, (T, A, 3), from that by `residual`, (K, len(frames), 3)."""
        moved = self.apart_back(self.weight[:, frames] * bar, self._simulated(u, frames))
        u_bar = np.zeros(u.shape)
        for n, t in enumerate(frames):
            u_bar[t] = self.carry.T @ moved[:, n]
        return u_bar

    def apart(self, moved: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Simulated displacements, (K, len(frames), 3), minus the seen ones [m]."""
        return moved - self.displacement[:, frames]

    def apart_back(self, bar: np.ndarray, moved: np.ndarray) -> np.ndarray:
        """The derivative by `moved` from that by what `apart` gives, (K, len(frames), 3)."""
        return bar

    @property
    def moving(self) -> np.ndarray:
        """Points that go at least a tenth as far as the one that goes farthest, (K,) bool.

        Where the tissue stays still every simulation is right, and a median over the whole surface
        cannot tell a good one from a bad one.
        """
        farthest = np.linalg.norm(self.displacement * (self.weight > 0), axis=-1).max(1)
        return farthest > 0.1 * np.percentile(farthest, 99)

    def error(self, u: np.ndarray, frames: np.ndarray) -> float:
        """Mean distance between simulated and seen points that move, at `frames` [m]; NaN if none is seen."""
        distance = self.each(u, frames)[self._counted(frames)]
        return float(np.mean(distance)) if len(distance) else float("nan")

    def each(self, u: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Distance of every point that moves, at `frames` [m], (K, len(frames)); NaN where it does not count."""
        if not len(frames):
            return np.full((len(self.rest), 0), np.nan)
        apart = np.where(self.weight[:, frames] > 0, self.apart(self._simulated(u, frames), frames), 0.0)
        return np.where(self._counted(frames), np.linalg.norm(apart, axis=-1), np.nan)

    def _counted(self, frames: np.ndarray) -> np.ndarray:
        """Whether a point moves and is seen then, (K, len(frames)) bool."""
        return (self.weight[:, frames] > 0).any(-1) & self.moving[:, None]

    def _simulated(self, u: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Displacements of the points [m], (K, len(frames), 3)."""
        return np.stack([self.carry @ u[t].astype(float) for t in frames], 1)


@dataclass(frozen=True)
class Filmed(Observation):
    """The same points across the view as a picture shows them, along it only where depth's change is measured."""

    camera: Camera
    pixels: np.ndarray
    """Where they were seen [px], (K, T, 2), zero where not."""
    light: Brightness | None = None
    """How bright they looked; none where that is left aside."""

    def carried_by(self, simulator: Simulator) -> Self:
        light = self.light.carried_by(simulator) if self.light else None
        return replace(super().carried_by(simulator), light=light)

    def apart(self, moved: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """Across the view at the depth of frame 0, and along it [m], (K, len(frames), 3)."""
        pixels = self.camera.project(self.rest[:, None] + moved)
        across = (pixels - self.pixels[:, frames]) * self.rest[:, None, 2:] / [self.camera.fx, self.camera.fy]
        return np.concatenate([across, moved[..., 2:] - self.displacement[:, frames, 2:]], -1)

    def apart_back(self, bar: np.ndarray, moved: np.ndarray) -> np.ndarray:
        at = self.rest[:, None] + moved
        nearer = self.rest[:, None, 2:] / at[..., 2:]
        slide = nearer * (bar[..., :2] * at[..., :2]).sum(-1, keepdims=True) / at[..., 2:]
        return np.concatenate([nearer * bar[..., :2], bar[..., 2:] - slide], -1)


def observe(tracks: Tracks, motion: Motion, camera: Camera, simulator: Simulator, *, floor: float) -> Filmed:
    """Points that the body can carry and that are not themselves driven.

    floor: least standard deviation of a component [m]: no tracker is exact, and the body's own
    discretisation is not either. Raises Problem when fewer than 10 points remain.
    """
    rest = tracks.xyz[:, 0].astype(float)
    usable = np.isfinite(rest).all(1) & tracks.visible[:, 0]
    carry = simulator.carry(np.where(usable[:, None], rest, simulator.rest[0]))
    usable &= abs(simulator.support(carry) - 1) < 0.05
    for j in range(len(motion.radius)):
        usable &= np.linalg.norm(rest - motion.center_rest[j], axis=1) > motion.radius[j]
    if usable.sum() < 10:
        raise Problem(
            f"tracks: only {int(usable.sum())} points lie on the body and outside the grip, but 10 are needed to fit "
            "its physics. Use a longer focal, a larger working size, or estimation.enabled: false."
        )
    carry, rest = carry[usable], rest[usable]
    moved = (tracks.xyz - tracks.xyz[:, :1])[usable].astype(float)
    seen = tracks.visible[usable] & np.isfinite(moved).all(-1)
    across, along = np.moveaxis(tracks.sigma_xyz[usable].astype(float), -1, 0)
    sigma = np.sqrt(np.stack([across, across, along], -1) ** 2 + floor**2)
    used = np.repeat(seen[..., None], 3, -1)
    used[..., 2] &= along < MEASURED * rest[:, None, 2]
    # A point's place in frame 0 is where its depth was lifted from, to rounding.
    pixels = tracks.xy[usable] - tracks.xy[usable, :1] + camera.project(rest)[:, None]
    return Filmed(
        rest,
        np.where(seen[..., None], moved, 0.0),
        np.where(used, 1 / sigma, 0.0),
        carry.tocsr(),
        camera,
        np.where(seen[..., None], pixels, 0.0),
    )


def phases(motion: Motion, frames: int) -> np.ndarray:
    """Index into PHASES of every frame, (T,): before any grip, carried, held still, after the release."""
    phase = np.zeros(frames, int)
    held = motion.active.any(0) if len(motion.active) else np.zeros(frames, bool)
    begun = np.maximum.accumulate(held)
    phase[begun & ~held] = PHASES.index("release")
    if held.any():
        speed = np.linalg.norm(np.gradient(motion.position, axis=1), axis=-1).max(0)
        quick = speed > 0.15 * speed[held].max()
        phase[held] = np.where(quick[held], PHASES.index("load"), PHASES.index("hold"))
    return phase


def fitted_frames(split: np.ndarray) -> np.ndarray:
    """Frames that estimation may look at, without frame 0, which is the reference."""
    return np.flatnonzero(split == USED)[np.flatnonzero(split == USED) > 0]
