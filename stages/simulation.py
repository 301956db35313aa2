"""Replay the recorded manipulation, or run a new one, on the fitted body.

reads   body.npz, scene.ply, material.npz, physics.json, motion.npz, camera.json, frames.npz, masks.npz,
        a new operation (JSON)
writes  replay.npz (every frame), video.mp4, final.ply (coloured points), yt.png (one column over time)
"""

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.masks import Masks
from surgisim.artifacts.material import Material
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.physics import Physics
from surgisim.artifacts.replay import Replay
from surgisim.artifacts.scene import Scene
from surgisim.config.simulation import Simulation
from surgisim.stage import Bytes, Source, stage


@stage(
    reads={
        "body": Body,
        "scene": Scene,
        "material": Material,
        "physics": Physics,
        "motion": Motion,
        "camera": Camera,
        "frames": Frames,
        "masks": Masks,
        "operation": Source("a JSON of what to do (docs/operations.md), instead of the recording's", required=False),
    },
    writes={"replay": Replay, "video": Bytes(".mp4"), "final": Bytes(".ply"), "yt": Bytes(".png")},
    settings=Simulation,
)
def main(body, scene, material, physics, motion, camera, frames, masks, operation, *, settings, progress):
    from surgisim.simulation.operation import read_operation
    from surgisim.simulation.outputs import final_ply, yt_png
    from surgisim.simulation.replay import replay
    from surgisim.video import mp4

    if operation is not None:
        settings = settings.model_copy(update={"operation": read_operation(operation)})
    moved = replay(body, scene, material, physics, motion, camera, settings, progress, recording=(frames, masks))
    shown = moved.rgb if len(moved.rgb) else frames.rgb[:1]
    return moved, mp4(shown, camera.fps), final_ply(moved, body), yt_png(shown, motion, camera)


if __name__ == "__main__":
    main()
