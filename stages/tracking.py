"""Follow points of the tissue, and find where and when the instrument holds it.

reads   frames.npz, masks.npz, correspondence.npz, depth.npz, camera.json
writes  tracks.npz  Tracks [px], camera frame [m]   motion.npz  Motion, camera frame [m]
"""

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.correspondence import Correspondence
from surgisim.artifacts.depth import Depth
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.masks import Masks
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.tracks import Tracks
from surgisim.config.tracking import Tracking
from surgisim.stage import stage


@stage(
    reads={"frames": Frames, "masks": Masks, "correspondence": Correspondence, "depth": Depth, "camera": Camera},
    writes={"tracks": Tracks, "motion": Motion},
    settings=Tracking,
)
def main(frames, masks, correspondence, depth, camera, *, settings, progress):
    from surgisim.perception.tracking.follow import follow

    return follow(frames, masks, correspondence, depth, camera, settings, progress=progress)


if __name__ == "__main__":
    main()
