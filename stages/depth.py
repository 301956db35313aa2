"""Tell how far away the tissue is, behind the instrument too.

reads   frames.npz, inpainted.npz, masks.npz, correspondence.npz, given.npz, camera.json
writes  depth.npz  Depth, camera frame [m]
"""

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.correspondence import Correspondence
from surgisim.artifacts.depth import Depth
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.artifacts.inpainted import Inpainted
from surgisim.artifacts.masks import Masks
from surgisim.config.depth import Depth as Settings
from surgisim.stage import stage


@stage(
    reads={
        "frames": Frames,
        "inpainted": Inpainted,
        "masks": Masks,
        "correspondence": Correspondence,
        "given": Given,
        "camera": Camera,
    },
    writes={"depth": Depth},
    settings=Settings,
)
def main(frames, inpainted, masks, correspondence, given, camera, *, settings, progress):
    from surgisim.perception.depth.distance import depth

    return depth(frames, inpainted, masks, correspondence, given, camera, settings, progress=progress)


if __name__ == "__main__":
    main()
