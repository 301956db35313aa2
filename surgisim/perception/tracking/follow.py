"""Follow the tissue through a recording and find what carries it."""

import importlib
import sys
from collections.abc import Callable

import numpy as np
from scipy.ndimage import median_filter

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.correspondence import Correspondence
from surgisim.artifacts.depth import Depth
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.masks import Masks
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.tracks import Tracks
from surgisim.config.tracking import Tracking
from surgisim.perception.grasp.carry import carry
from surgisim.perception.grasp.contact import frame_flow
from surgisim.perception.grasp.find import LIKELY, Grip, find
from surgisim.perception.grasp.following import jaw_motion
from surgisim.perception.grasp.given import given
from surgisim.perception.grasp.instruments import Instrument, instruments, nearest
from surgisim.perception.grasp.outline import outlines
from surgisim.perception.grasp.say import advice, whose
from surgisim.perception.masking.appearance import lit
from surgisim.perception.tracking import Paths
from surgisim.perception.tracking.lift import lift
from surgisim.perception.tracking.points import at, shrink, spread_points
from surgisim.problem import Problem

DENSE = 2000
"""Points followed to find a grasp and to choose from."""
SURE = 0.6
"""Confidence of a grasp below which the run says how to mark it."""


def follow(
    frames: Frames,
    masks: Masks,
    surface: Correspondence,
    depth: Depth,
    camera: Camera,
    settings: Tracking,
    *,
    progress: Callable[[float, float, str], None] | None = None,
) -> tuple[Tracks, Motion]:
    """Tissue tracks and the grasp of one recording."""
    rgb = frames.rgb
    shapes = {"masks": masks.tool.shape, "correspondence": surface.hidden.shape, "depth": depth.z.shape}
    for name, shape in shapes.items():
        if shape != rgb.shape[:3]:
            raise Problem(f"tracking: {name} are {shape} and frames {rgb.shape[:3]}; pass files of one clip and size.")
    if not masks.tissue[0].any():
        raise Problem("tracking: frame 0 shows no tissue to follow. Check masks.npz.")
    usable = shrink(masks.tissue[0], 1) if shrink(masks.tissue[0], 1).any() else masks.tissue[0]
    grips = given(settings.grasp, camera, masks.tissue[0] | masks.tool[0])
    everywhere = np.ones_like(masks.tissue[0])
    spread_count = max(DENSE, 2 * settings.points)
    queries = spread_points(everywhere, min(spread_count, everywhere.size // 4))
    cell = everywhere.size / len(queries)
    paths = _backend(settings.backend)(rgb, surface, masks.specular, queries, settings=settings, progress=progress)
    source, side, seen = "given" if grips else "found", max(rgb.shape[1:3]), []
    flow = frame_flow(rgb) if masks.tool.any() and len(rgb) > 1 else None
    tools = instruments(masks.tool, lit(rgb)[0], flow) if flow is not None else []
    if not grips and settings.find_grasp and tools:
        xy = median_filter(paths.xy.astype(float), size=(1, 3, 1), mode="nearest")
        seen = find(xy, paths.visible, tools, flow, side, cell)
        grips = sorted((g for g in seen if g.confidence >= LIKELY), key=lambda g: g.begin)
    holders = [g.instrument if g.instrument >= 0 else nearest(tools, g.center, g.begin) for g in grips]
    jaws = [jaw_motion(flow, tools[h], side) if h is not None else None for h in holders]
    tips = [_tip(rgb, tools[h], camera, g) if h is not None else None for h, g in zip(holders, grips, strict=True)]
    motion = carry(grips, paths, jaws, tips, depth, camera, source)
    _say(motion, camera, settings, [whose(tools, grip) for grip in grips], advice(seen, tools, camera))
    keep = _choose(queries, usable, grips, settings)
    if not keep.any():
        raise Problem("tracking: the tissue of frame 0 is too small to follow a point on. Check masks.npz.")
    chosen = Paths(paths.xy[keep], paths.visible[keep], paths.sigma[keep])
    return lift(chosen, depth, camera), motion


def _tip(rgb: np.ndarray, tool: Instrument, camera: Camera, grip: Grip) -> np.ndarray:
    """Where the tip of a grip's instrument is while it holds, by its outline [px], NaN elsewhere, (T, 2)."""
    (outline,) = outlines(rgb, [tool], camera)
    out, frames = np.full((len(rgb), 2), np.nan), np.arange(grip.begin, grip.end + 1)
    out[frames] = outline.carried(frames, int(frames[len(frames) // 2]))[:, :2]
    return out * [camera.fx, camera.fy] + [camera.cx, camera.cy]


def _backend(name: str):
    return importlib.import_module(f"surgisim.perception.tracking.{name}").track


def _choose(queries: np.ndarray, usable: np.ndarray, grips: list[Grip], settings: Tracking) -> np.ndarray:
    """Which points to keep: an even spread over the tissue, and more of them about the grips, (K,) bool."""
    on = at(usable, queries)
    keep = np.zeros(len(queries), bool)
    index = np.flatnonzero(on)
    for point in spread_points(usable, settings.points):
        keep[index[np.argmin(((queries[index] - point) ** 2).sum(-1))]] = True
    if grips and settings.points_near_grasp:
        near = np.min([np.linalg.norm(queries - g.center, axis=-1) / g.radius for g in grips], axis=0)
        rest = np.flatnonzero(on & ~keep & (near < 6))
        keep[rest[np.argsort(near[rest], kind="stable")[: settings.points_near_grasp]]] = True
    return keep


def _say(motion: Motion, camera: Camera, settings: Tracking, holders: list[str], hint: str) -> None:
    """What was found, at once; and how to mark what was not, or is not sure."""
    if motion.source == "none":
        why = "no instrument was seen to hold tissue" if settings.find_grasp else "none was given and none looked for"
        print(f"tracking: no grasp: {why}; nothing will be driven.", file=sys.stderr)
    for active, confidence, radius, holder in zip(
        motion.active, motion.confidence, motion.radius, holders, strict=True
    ):
        first, last = np.flatnonzero(active)[[0, -1]]
        print(
            f"tracking: grasp {motion.source}{holder}: {first / camera.fps:.2f} to {last / camera.fps:.2f} s, "
            f"radius {1e3 * radius:.1f} mm, confidence {confidence:.2f}.",
            file=sys.stderr,
        )
    if settings.find_grasp and motion.source != "given" and (motion.source == "none" or min(motion.confidence) < SURE):
        print(f"tracking: {hint}", file=sys.stderr)
