"""Draw the pictures of a run that the README shows.

reads   recording, camera, scene and replay of a run
writes  moving.webp     the recording beside the replay, moving
        scene.jpg       the scene from the camera and from its side
"""

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.replay import Replay
from surgisim.artifacts.scene import Scene
from surgisim.config.base import Settings
from surgisim.stage import Bytes, stage


@stage(
    reads={"frames": Frames, "camera": Camera, "scene": Scene, "replay": Replay},
    writes={"moving": Bytes(".webp"), "still": Bytes(".jpg")},
    settings=Settings,
)
def main(frames, camera, scene, replay, *, settings, progress):
    from surgisim.report.small_pictures import moving, still

    return moving(frames, replay, camera), still(scene, camera)


if __name__ == "__main__":
    main()
