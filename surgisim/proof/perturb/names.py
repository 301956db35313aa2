"""What perturbations there are, and how each is made; the rules read this, so nothing heavy is imported."""

from collections.abc import Mapping
from typing import Any

AS_IS = "as_is"
"""What perturbed recordings are compared with."""
KEYED = (
    "release+1", "release-1", "noplate", "box3", "plane+3", "plane-3", "noplate_plane+3", "drift0.3", "drift1",
    "bilinear1", "jitter0.1", "jitter0.3", "focal+10", "focal-10", "missing2", "missing5", "missing20", "half_frames",
    "half_points", "noise2", "new_noise", "rotated",
)  # fmt: skip
"""Made of a phantom's recording, whose plate and true paths are known."""
KEYLESS = ("release+1", "release-1", "box0.3", "box3", "missing5", "noise1.1", "rotated")
"""Made of any recording."""
INVENTED: Mapping[str, Mapping[str, Any]] = {
    "fast": {"lag": 3e-4},
    "release_between": {"close_phase": 0.5, "release_phase": 0.5},
}
"""Made of a phantom's scene, which is invented once more with these settings."""
SETTINGS: Mapping[str, Mapping[str, Any]] = {"finer_grid": {"grid": 0.13}}
"""The recording as it is, diagnosed with these settings."""
