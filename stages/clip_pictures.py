"""Draw the small pictures of a run, for a gallery or a README.

reads   recording, camera, scene, fitted body and replay of a run
writes  moving.webp     the recording beside the replay, moving
        scene.jpg       the scene from the camera and from its side
        body.jpg        the fitted body, and its replay cut open where it has moved farthest
"""

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.material import Material
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.replay import Replay
from surgisim.artifacts.scene import Scene
from surgisim.config.pictures import Pictures
from surgisim.stage import Bytes, stage


@stage(
    reads={
        "frames": Frames, "camera": Camera, "scene": Scene,
        "body": Body, "material": Material, "motion": Motion, "replay": Replay,
    },
    writes={"moving": Bytes(".webp"), "still": Bytes(".jpg"), "fitted": Bytes(".jpg")},
    settings=Pictures,
)  # fmt: skip
def main(frames, camera, scene, body, material, motion, replay, *, settings, progress):
    from surgisim.report import small_pictures

    return (
        small_pictures.moving(frames, replay, camera, settings.moving_bytes),
        small_pictures.still(scene, camera, settings.still_bytes),
        small_pictures.fitted(body, material, motion, replay, settings.still_bytes),
    )


if __name__ == "__main__":
    main()
