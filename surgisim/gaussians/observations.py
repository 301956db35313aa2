"""What the reconstruction may look at, and how much each pixel counts.

Frames held out between used ones are left out here, at the door: nothing behind it can see them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from surgisim.artifacts.correspondence import Correspondence
from surgisim.artifacts.depth import Depth
from surgisim.artifacts.frames import BETWEEN, Frames
from surgisim.artifacts.inpainted import COPIED, INVENTED, SEEN, Inpainted
from surgisim.artifacts.masks import Masks
from surgisim.config.reconstruction import Reconstruction
from surgisim.problem import Problem

SEEN_IN_EACH = "rgb", "weight", "texture", "z", "trust", "went", "sure"


@dataclass(frozen=True)
class Observations:
    """U frames that may be looked at."""

    frame: np.ndarray
    """Their numbers in the clip, (U,)."""
    rgb: torch.Tensor
    """Colour with the instrument taken out, sRGB 0-1, (U, H, W, 3)."""
    weight: torch.Tensor
    """How much each pixel's colour counts, 0-1, (U, H, W)."""
    texture: torch.Tensor
    """The same where colours are all that tells where tissue goes: highlights stay where they are, (U, H, W)."""
    z: torch.Tensor
    """Depth [m], (U, H, W)."""
    trust: torch.Tensor
    """How much each pixel's depth counts, 0-1, (U, H, W)."""
    went: torch.Tensor
    """How far frame 0's pixels were seen to go [px], (U, H, W, 2), half precision."""
    sure: torch.Tensor
    """How much that counts, 0-1, (U, H, W), half precision."""

    def on(self, device: torch.device) -> "Observations":
        """The same, on this device."""
        return Observations(self.frame, **{name: getattr(self, name).to(device) for name in SEEN_IN_EACH})

    def of(self, frames: Sequence[int]) -> "Observations":
        """These of the U frames, which may be named twice."""
        # Rows are stacked one by one: an index would have to be brought to a GPU, which waits for it.
        rows = {name: torch.stack([getattr(self, name)[u] for u in frames]) for name in SEEN_IN_EACH}
        return Observations(self.frame[list(frames)], **rows)


def observe(
    frames: Frames,
    inpainted: Inpainted,
    masks: Masks,
    surface: Correspondence,
    depth: Depth,
    settings: Reconstruction,
) -> Observations:
    """The used frames with their weights. Raises Problem if the inputs are not of one clip."""
    sizes = {"frames": frames.rgb.shape[:3], "inpainted": inpainted.rgb.shape[:3]}
    sizes |= {"masks": masks.tool.shape, "correspondence": surface.hidden.shape, "depth": depth.z.shape}
    if len(set(sizes.values())) > 1:
        raise Problem(f"reconstruction: {sizes} are not of one clip (frames, height, width). Check which are passed.")
    used = np.flatnonzero(frames.split != BETWEEN)
    if len(used) == 0 or used[0] != 0:
        raise Problem("reconstruction: frame 0 is held out, but it is the rest scene. Correct the split.")
    origin, tool, tissue = (a[used] for a in (inpainted.origin, masks.tool, masks.tissue))
    # An instrument's pixel that was not painted over shows the instrument: it counts nothing.
    weight = ((origin == SEEN) & tissue & ~tool).astype(np.float32)
    weight[origin == COPIED] = settings.weight_copied
    weight[origin == INVENTED] = settings.weight_invented
    shining = (origin == SEEN) & masks.specular[used] & ~tool
    weight[shining] = 1.0
    texture = np.where(shining, np.float32(settings.weight_specular), weight)
    shown = (weight > 0) | tissue
    trust = depth.confidence[used].astype(np.float32) * shown
    if not weight[0].any():
        raise Problem("reconstruction: frame 0 shows no tissue. Check the masks, or start the clip later.")
    return Observations(
        frame=used,
        rgb=torch.from_numpy(inpainted.rgb[used].astype(np.float32) / 255),
        weight=torch.from_numpy(weight),
        texture=torch.from_numpy(texture),
        z=torch.from_numpy(depth.z[used].astype(np.float32)),
        trust=torch.from_numpy(trust),
        went=torch.from_numpy(surface.moved[used]),
        # An error of over 256 px has no square in half precision.
        sure=torch.from_numpy(surface.seen[used] / (1 + surface.error[used].astype(np.float32) ** 2)).half(),
    )
