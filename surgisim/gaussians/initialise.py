"""The first guess of the scene: pixels of the recording set out in space.

The first frame's tissue is projected by its depth; a later frame adds the pixels that the instrument hid in every
frame before it (the paper, section 3.2). What no frame ever shows comes from the first inpainted frame, so that
the surface has no hole.
"""

import numpy as np
from scipy.ndimage import map_coordinates

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.scene import Scene
from surgisim.gaussians.attributes import stored
from surgisim.problem import Problem


def initialise(
    rgb: np.ndarray,
    z: np.ndarray,
    tool: np.ndarray,
    tissue: np.ndarray,
    camera: Camera,
    *,
    stride: float = 1.0,
    most: int = 60_000,
    radius: float = 0.6,
    opacity: float = 0.9,
    unseen: bool = True,
) -> Scene:
    """One round Gaussian for each pixel of a grid over the tissue.

    rgb      inpainted frames, sRGB 0-255, (T, H, W, 3) uint8
    z        depth [m], (T, H, W)
    tool     instrument, (T, H, W) bool
    tissue   tissue to learn from, (T, H, W) bool
    stride   distance between the grid's points [px]; grown until at most `most` of them are on tissue
    radius   of a Gaussian, in strides as seen at its depth
    opacity  of all of them, 0-1
    unseen   whether pixels that the instrument hides in all frames get Gaussians too

    Raises Problem when there is no tissue.
    """
    source = source_frame(tool, tissue, unseen)
    count = int((source >= 0).sum())
    if count == 0:
        raise Problem("initialise: no frame shows a pixel of tissue. Look at the masks.")
    stride = max(stride, (count / most) ** 0.5)
    while True:
        pixels, frame = _grid(source, stride)
        if len(pixels) <= most:
            break
        stride *= (len(pixels) / most) ** 0.5 * 1.001
    if len(pixels) == 0:
        raise Problem(f"initialise: {count} pixels of tissue, but none on a grid of {stride:g} px. Lower the stride.")

    color, depth = np.empty((len(pixels), 3)), np.empty(len(pixels))
    for t in np.unique(frame):
        mine = frame == t
        where = pixels[mine][:, ::-1].T
        depth[mine] = map_coordinates(z[t].astype(float), where, order=1, mode="nearest")
        for k in range(3):
            color[mine, k] = map_coordinates(rgb[t, :, :, k].astype(float), where, order=1, mode="nearest") / 255
    size = radius * stride * depth / (camera.fx * camera.fy) ** 0.5
    turn = np.tile([1.0, 0, 0, 0], (len(pixels), 1))
    return stored(
        camera.lift(pixels, depth), turn, np.repeat(size[:, None], 3, 1), np.full(len(pixels), opacity), color
    )


def source_frame(tool: np.ndarray, tissue: np.ndarray, unseen: bool = True) -> np.ndarray:
    """The frame that shows each pixel's tissue first, -1 where none does, (H, W) int64.

    Frame 0 gives its tissue. Frame t gives the tissue that the instrument hid in all of frames 0 to t - 1. With
    `unseen`, what it hides in all frames is taken from frame 0.
    """
    source = np.where(tissue[0], 0, -1)
    hidden = tool[0].copy()
    for t in range(1, len(tool)):
        source[hidden & tissue[t]] = t
        hidden &= tool[t]
    if unseen:
        source[hidden] = 0
    return source


def _grid(source: np.ndarray, stride: float) -> tuple[np.ndarray, np.ndarray]:
    """Points of the grid on tissue [px], (N, 2), and the frame each is taken from, (N,)."""
    height, width = source.shape
    first = (stride - 1) / 2
    y, x = np.meshgrid(np.arange(first, height - 0.5, stride), np.arange(first, width - 0.5, stride), indexing="ij")
    points = np.stack([x.ravel(), y.ravel()], 1)
    frame = source[np.rint(points[:, 1]).astype(int), np.rint(points[:, 0]).astype(int)]
    return points[frame >= 0], frame[frame >= 0]
