"""Everything a run left behind, checked to be of one clip."""

from dataclasses import dataclass

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.deformation import Deformation
from surgisim.artifacts.depth import Depth
from surgisim.artifacts.fit import Fit
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.artifacts.inpainted import Inpainted
from surgisim.artifacts.masks import Masks
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.physics import Physics
from surgisim.artifacts.replay import Replay
from surgisim.artifacts.scene import Scene
from surgisim.artifacts.tracks import Tracks
from surgisim.measure.truth_seen import TruthSeen
from surgisim.problem import Problem


@dataclass(frozen=True)
class OfScene:
    """What tells of a scene alone, before anything is simulated."""

    frames: Frames
    camera: Camera
    given: Given
    masks: Masks
    inpainted: Inpainted
    depth: Depth
    tracks: Tracks
    scene: Scene
    deformation: Deformation
    rendered: Frames
    truth: TruthSeen | None = None


@dataclass(frozen=True)
class Run:
    frames: Frames
    camera: Camera
    given: Given
    masks: Masks
    inpainted: Inpainted
    depth: Depth
    tracks: Tracks
    motion: Motion
    """As estimation fitted it."""
    scene: Scene
    deformation: Deformation
    rendered: Frames
    body: Body
    physics: Physics
    fit: Fit
    replay: Replay
    truth: TruthSeen | None = None
    found: Motion | None = None
    """The grip as tracking found it."""

    def __post_init__(self) -> None:
        size = self.frames.rgb.shape[:3]
        for name, shape in {
            "camera": (self.camera.frames, self.camera.height, self.camera.width),
            "masks": self.masks.tool.shape,
            "inpainted": self.inpainted.origin.shape,
            "depth": self.depth.z.shape,
            "rendered": self.rendered.rgb.shape[:3],
            "tracks": (self.tracks.visible.shape[1], *size[1:]),
        }.items():
            if tuple(shape) != size:
                raise Problem(f"{name} is of {tuple(shape)} frames and pixels, but frames are {size}: not of one clip.")
        if self.replay.position.shape[1] != len(self.body.rest):
            raise Problem(
                f"replay: moves {self.replay.position.shape[1]} particles, but the body has {len(self.body.rest)}: "
                "not of one run."
            )

    @property
    def length_unit(self) -> str:
        """Unit of the run's own lengths."""
        return "mm" if self.camera.scale == "known" else "mm, arbitrary scale"
