"""Find the tissue's physical parameters from its motion.

reads   body.npz, scene.ply, tracks.npz, motion.npz, frames.npz, masks.npz, camera.json
writes  material.npz (per particle), physics.json (laws, numbers, grid), fit.json (history, identifiability),
        motion.npz (the grips as fitted), body.npz (the body as it was laid for the fit), doubts.npz (how tracked points
        would go were what is open beside the laws otherwise)
"""

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.doubts import Doubts
from surgisim.artifacts.fit import Fit
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.masks import Masks
from surgisim.artifacts.material import Material
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.physics import Physics
from surgisim.artifacts.scene import Scene
from surgisim.artifacts.tracks import Tracks
from surgisim.config.estimation import Estimation
from surgisim.stage import stage


@stage(
    reads={
        "body": Body,
        "scene": Scene,
        "tracks": Tracks,
        "motion": Motion,
        "frames": Frames,
        "masks": Masks,
        "camera": Camera,
    },
    writes={"material": Material, "physics": Physics, "fit": Fit, "carried": Motion, "laid": Body, "doubts": Doubts},
    settings=Estimation,
)
def main(body, scene, tracks, motion, frames, masks, camera, *, settings, progress):
    from surgisim.estimation.fit import estimate

    return estimate(body, scene, tracks, motion, frames, masks, camera, settings, progress)


if __name__ == "__main__":
    main()
