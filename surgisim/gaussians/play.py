"""A clip's scene drawn at any moment: what a viewer shows, and the frames that are kept beside the recording."""

import numpy as np
import torch

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.scene import Scene
from surgisim.deformation.field import Field
from surgisim.gaussians.rasterise import engine_on, rasterise
from surgisim.gaussians.tint import clock, shares


class Play:
    """Scene, field and changing colours on one device."""

    def __init__(
        self, scene: Scene, field: Field, moments: np.ndarray, tint: np.ndarray, camera: Camera, device: str = "cpu"
    ) -> None:
        """moments: of the frames that were looked at [s], (M,); tint: what is added to the colours at each knot, sRGB
        0-1, (K, G, 3)."""
        self.device = torch.device(device)
        self.field, self.camera, self.moments = field.on(self.device), camera, moments
        names = "mean", "rotation", "scale", "opacity", "color"
        self.mean, self.rotation, self.scale, self.opacity, self.color = (
            torch.from_numpy(np.ascontiguousarray(getattr(scene, name), np.float32)).to(self.device) for name in names
        )
        self.tint = torch.from_numpy(tint).to(self.device)

    @torch.no_grad()
    def rgb(self, time: float, *, checked: bool = True) -> torch.Tensor:
        """The picture at `time` [s], sRGB, colours outside of 0-1 not cut, (H, W, 3).

        checked: whether values are looked at first, which waits for all that a GPU still does; raises Problem then for
        those that are not finite.
        """
        moved, opacity, turn, grow = self.field(self.mean, time)
        return rasterise(
            self.mean + moved,
            self.rotation + turn,
            (self.scale + grow).exp(),
            torch.sigmoid(self.opacity + opacity),
            self.colors(time),
            self.camera,
            engine=engine_on(self.device),
            weigh=False,
            checked=checked,
        ).rgb

    def colors(self, time: float) -> torch.Tensor:
        """The Gaussians' colours at `time` [s], sRGB 0-1, (G, 3)."""
        color = self.color
        for k, share in shares(clock(time, self.moments), len(self.tint)).items():
            color = torch.add(color, self.tint[k].float(), alpha=share)
        return color
