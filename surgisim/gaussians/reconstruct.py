"""The canonical scene and its deformation field, from the recording.

Wang, Yang, Zhao, Yang and Shen, Realistic surgical simulation from monocular videos, section 3.2.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numba
import numpy as np
import torch

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.correspondence import Correspondence
from surgisim.artifacts.deformation import Deformation
from surgisim.artifacts.depth import Depth
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.inpainted import Inpainted
from surgisim.artifacts.masks import Masks
from surgisim.artifacts.scene import Scene
from surgisim.config.reconstruction import Reconstruction
from surgisim.deformation.field import save_field
from surgisim.gaussians.engine_gsplat import lacking
from surgisim.gaussians.fit import Fit, Say
from surgisim.gaussians.initialise import initialise
from surgisim.gaussians.observations import observe
from surgisim.gaussians.play import Play
from surgisim.gaussians.rasterise import to_bytes
from surgisim.problem import Problem


@dataclass(frozen=True)
class Reconstructed:
    scene: Scene
    """The canonical scene, which is frame 0."""
    deformation: Deformation
    rendered: Frames
    """Every frame again, also those held out."""


def reconstruct(
    frames: Frames,
    inpainted: Inpainted,
    masks: Masks,
    surface: Correspondence,
    depth: Depth,
    camera: Camera,
    settings: Reconstruction,
    progress: Say = lambda done, total, text: None,
) -> Reconstructed:
    """Fit scene and field to the frames that are not held out between used ones.

    On the CPU the same inputs, settings and number of threads give the same bytes. Raises Problem for inputs that are
    not of one clip, for frames without tissue, where the device is missing, and when a number is no longer finite
    (naming iteration and frame).
    """
    missing = lacking() if settings.device == "cuda" else ""
    if missing:
        raise Problem(
            f"reconstruction: 'device' is cuda, which needs {missing}; this machine lacks it. Install it, or set "
            "reconstruction.device to cpu."
        )
    seen = observe(frames, inpainted, masks, surface, depth, settings)
    start = initialise(
        inpainted.rgb[seen.frame],
        depth.z[seen.frame],
        masks.tool[seen.frame],
        masks.tissue[seen.frame] | (masks.specular[seen.frame] & ~masks.tool[seen.frame]),
        camera,
        stride=settings.gaussians_per_pixel**-0.5,
        most=max(int(settings.most_gaussians / settings.growth), 1),
    )
    with threads(settings.threads, same_bytes=settings.device == "cpu"):
        fit = Fit(start, seen, camera, len(frames.rgb), settings)
        history = fit.run(progress)
        scene, field, tint = fit.result()
        play = Play(scene, field, fit.moments, tint, camera, settings.device)
        rgb = np.stack([to_bytes(play.rgb(t / camera.fps).cpu().numpy()) for t in range(len(frames.rgb))])
    return Reconstructed(scene, save_field(field, fit.moments, tint, history), Frames(rgb, frames.split))


@contextmanager
def threads(count: int, *, same_bytes: bool) -> Iterator[None]:
    """Let torch and the compiled loops use this many threads, as far as there are, and give back what was set.

    same_bytes: whether torch may not add slopes in the order in which its threads come by, as it does where Gaussians
    are read by their numbers.
    """
    before = torch.get_num_threads(), numba.get_num_threads()
    strict, filled = torch.are_deterministic_algorithms_enabled(), torch.utils.deterministic.fill_uninitialized_memory
    torch.use_deterministic_algorithms(same_bytes or strict)
    # It would also fill all memory that is asked for, which no sum of ours reads.
    torch.utils.deterministic.fill_uninitialized_memory = filled and strict
    torch.set_num_threads(count)
    numba.set_num_threads(min(count, numba.config.NUMBA_NUM_THREADS))
    try:
        yield
    finally:
        torch.set_num_threads(before[0])
        numba.set_num_threads(before[1])
        torch.use_deterministic_algorithms(strict)
        torch.utils.deterministic.fill_uninitialized_memory = filled
