"""Fit the canonical 3D Gaussians and the field that moves them through the clip.

reads   frames.npz, inpainted.npz, masks.npz, correspondence.npz, depth.npz, camera.json
writes  scene.ply         canonical scene = frame 0, camera frame [m]
        deformation.npz   feature planes and head, and the history of the fit
        rendered.npz      every frame re-rendered, also those held out
"""

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.correspondence import Correspondence
from surgisim.artifacts.deformation import Deformation
from surgisim.artifacts.depth import Depth
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.inpainted import Inpainted
from surgisim.artifacts.masks import Masks
from surgisim.artifacts.scene import Scene
from surgisim.config.reconstruction import Reconstruction
from surgisim.stage import stage


@stage(
    reads={
        "frames": Frames,
        "inpainted": Inpainted,
        "masks": Masks,
        "correspondence": Correspondence,
        "depth": Depth,
        "camera": Camera,
    },
    writes={"scene": Scene, "deformation": Deformation, "rendered": Frames},
    settings=Reconstruction,
)
def main(frames, inpainted, masks, correspondence, depth, camera, *, settings, progress):
    from surgisim.gaussians.reconstruct import reconstruct

    done = reconstruct(frames, inpainted, masks, correspondence, depth, camera, settings, progress)
    return done.scene, done.deformation, done.rendered


if __name__ == "__main__":
    main()
