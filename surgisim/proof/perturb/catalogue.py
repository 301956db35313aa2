"""Every perturbation that is made of a recording, by name."""

from collections.abc import Callable, Mapping

import numpy as np

from surgisim.problem import Problem
from surgisim.proof.perturb import camera, grips, mount, samples, tracking
from surgisim.proof.perturb.turn import rotated
from surgisim.recordings.recording import Recording

Perturb = Callable[[Recording, np.random.Generator, np.ndarray | None], Recording]
"""Of a recording, a generator, and the noise-free paths [m], (K, T, 3), where they are known."""

PERTURBED: Mapping[str, Perturb] = {
    "release+1": lambda r, rng, true: grips.longer(r, 1),
    "release-1": lambda r, rng, true: grips.longer(r, -1),
    "noplate": lambda r, rng, true: mount.without_plate(r),
    "box3": lambda r, rng, true: mount.reaching(mount.bare(r), 3e-3),
    "plane+3": lambda r, rng, true: mount.shifted(r, 3e-3),
    "plane-3": lambda r, rng, true: mount.shifted(r, -3e-3),
    "noplate_plane+3": lambda r, rng, true: mount.shifted(mount.without_plate(r), 3e-3),
    "drift0.3": lambda r, rng, true: camera.drifted(r, rng, 0.3e-3),
    "drift1": lambda r, rng, true: camera.drifted(r, rng, 1e-3),
    "bilinear1": lambda r, rng, true: camera.bent(r, rng, 1e-3),
    "jitter0.1": lambda r, rng, true: camera.shaken(r, rng, 0.1e-3),
    "jitter0.3": lambda r, rng, true: camera.shaken(r, rng, 0.3e-3),
    "focal+10": lambda r, rng, true: camera.zoomed(r, 1.1),
    "focal-10": lambda r, rng, true: camera.zoomed(r, 0.9),
    "missing2": lambda r, rng, true: samples.lost(r, rng, 0.02),
    "missing5": lambda r, rng, true: samples.lost(r, rng, 0.05),
    "missing20": lambda r, rng, true: samples.lost(r, rng, 0.20),
    "half_frames": lambda r, rng, true: samples.half_frames(r),
    "half_points": lambda r, rng, true: samples.half_points(r, rng),
    "noise2": lambda r, rng, true: tracking.noisier(r, rng, true, 2.0),
    "new_noise": lambda r, rng, true: tracking.tracked_again(r, rng, true),
    "rotated": lambda r, rng, true: rotated(r, rng),
    # For recordings whose true paths nobody knows.
    "box0.3": lambda r, rng, true: mount.reaching(mount.bare(r), 0.3e-3),
    "noise1.1": lambda r, rng, true: tracking.noisier(r, rng, None, 1.1),
}


def perturbed(name: str, recording: Recording, seed: int, true: np.ndarray | None = None) -> Recording:
    """The recording perturbed; the same every time. Raises Problem where there is no such perturbation."""
    if name not in PERTURBED:
        raise Problem(f"perturbation '{name}' is not known here. Choose of {', '.join(PERTURBED)}.")
    # Of its name too: the same recording gets other numbers for another perturbation.
    rng = np.random.default_rng([seed, *f"{name}/{recording.name}".encode()])
    return PERTURBED[name](recording, rng, true)
