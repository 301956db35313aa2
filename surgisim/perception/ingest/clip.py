"""A recording of any kind, brought to frames, camera and what came with it."""

from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path

import numpy as np

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.config.ingest import Ingest
from surgisim.perception.ingest.border import is_black, lit_box
from surgisim.perception.ingest.clock import is_still, shown_again, split, thumbnail
from surgisim.perception.ingest.recording import ASSUMED_FPS, Recording, recognise
from surgisim.perception.ingest.working_size import Window, window
from surgisim.problem import Problem

SMALLEST = 32
"""Shortest side that can be worked on [px]."""
Progress = Callable[[float, float, str], None]


def ingest(clip: Path, settings: Ingest, *, progress: Progress) -> tuple[Frames, Camera, Given]:
    """Read `clip` twice: once to find its border and repeated frames, once to keep what is wanted."""
    recording = recognise(
        clip,
        max_pixels=settings.max_pixels,
        max_unpacked=settings.max_unpacked,
        given_masks=settings.given_masks,
    )
    fps = settings.fps or recording.fps or ASSUMED_FPS
    progress(0, 2, f"looking through {clip.name}")
    top, kept, repeat, more = _survey(recording, fps, settings)
    source = (top.shape[1], top.shape[0])
    view = window(_crop(clip, top, settings), size=settings.size)
    if min(view.to_width, view.to_height) < SMALLEST:
        raise Problem(
            f"{clip}: frames would be {view.to_width} x {view.to_height} px, but at least {SMALLEST} on each side are "
            "wanted. Pass a larger recording or a wider ingest.crop."
        )
    progress(1, 2, f"reading {len(kept)} frames")
    wanted = set(kept.tolist())
    rgb = np.stack([view.colour(f) for i, f in _part(recording, kept[-1] + 1) if i in wanted])
    camera = _camera(clip, recording, settings, view, source, fps / repeat, len(rgb))
    frames = Frames(rgb, split(len(rgb), every=settings.every, first=settings.first, tail=settings.tail))
    given = _given(recording, kept, view, settings)
    progress(2, 2, _words(camera, frames, given, repeat, more))
    return frames, camera, given


def _survey(recording: Recording, fps: float, settings: Ingest) -> tuple[np.ndarray, np.ndarray, int, bool]:
    """Brightest level of each pixel, frames to keep, how often each is shown, and whether there were more."""
    begin = round(settings.start * fps)
    end = None if settings.end is None else round(settings.end * fps)
    # Four times as many frames as are kept: a container may show each of them up to four times.
    room = begin + 4 * settings.max_frames
    stop = min(room, end) if end is not None else room
    top, small, index = None, [], -1
    for index, frame in _part(recording, stop):
        if top is not None and frame.shape != top.shape:
            h, w = frame.shape[:2]
            raise Problem(
                f"{recording.where}: frame {index} is {w} x {h} px, but those before are {top.shape[1]} x "
                f"{top.shape[0]}. Pass frames of one size."
            )
        if index < begin:
            continue
        top = frame.copy() if top is None else np.maximum(top, frame, out=top)
        small.append(thumbnail(frame))
    if len(small) < 2:
        raise Problem(
            f"{recording.where}: {len(small)} frame{'' if len(small) == 1 else 's'} between {settings.start} s and "
            f"{'the end' if settings.end is None else f'{settings.end} s'} of {index + 1} read, but at least 2 are "
            "wanted to see anything move. Pass a longer recording."
        )
    top = top.max(-1)
    if is_black(top):
        raise Problem(f"{recording.where}: every frame is black. Pass a recording that shows something.")
    kept, repeat = shown_again(np.stack(small)) if settings.drop_duplicates else (np.arange(len(small)), 1)
    more = len(kept) > settings.max_frames
    return top, begin + kept[: settings.max_frames], repeat, more


def _part(recording: Recording, stop: int) -> Iterator[tuple[int, np.ndarray]]:
    return islice(enumerate(recording.frames()), int(stop))


def _crop(clip: Path, top: np.ndarray, settings: Ingest) -> tuple[int, int, int, int]:
    height, width = top.shape
    if settings.crop == "none":
        return 0, 0, width, height
    if settings.crop == "auto":
        return lit_box(top)
    left, upper, across, down = settings.crop
    if min(left, upper) < 0 or min(across, down) < 1 or left + across > width or upper + down > height:
        raise Problem(
            f"{clip}: ingest.crop {list(settings.crop)} (left, top, width, height) does not lie inside the recording's "
            f"{width} x {height} px. Correct it."
        )
    return left, upper, across, down


def _camera(
    clip: Path,
    recording: Recording,
    settings: Ingest,
    view: Window,
    source: tuple[int, int],
    fps: float,
    frames: int,
) -> Camera:
    given = settings.focal or recording.focal
    focal = given or 0.9 * max(view.width, view.height)
    # A calibration speaks of the whole sensor; without one the lit part's middle is the best guess of the axis.
    middle = ((source[0] - 1) / 2, (source[1] - 1) / 2)
    lit = (view.left + (view.width - 1) / 2, view.top + (view.height - 1) / 2)
    cx, cy = view.pixel(*(settings.principal or (middle if given else lit)))
    return Camera(
        width=view.to_width,
        height=view.to_height,
        fx=focal * view.to_width / view.width,
        fy=focal * view.to_height / view.height,
        cx=cx,
        cy=cy,
        fps=fps,
        frames=frames,
        scale="known" if recording.depth else "arbitrary",
        focal_from="given" if given else "assumed",
        source=clip.name,
        source_size=list(source),
        crop=[view.left, view.top, view.width, view.height],
    )


def _given(recording: Recording, kept: np.ndarray, view: Window, settings: Ingest) -> Given:
    size = (view.to_height, view.to_width)
    tool = np.zeros((0, *size), bool)
    depth = np.zeros((0, *size), np.float32)
    right = np.zeros((0, *size, 3), np.uint8)
    if recording.tool:
        grey = np.stack([view.mask(recording.tool(i)) for i in kept])
        # White may be stored as 255 or as 1.
        tool = (grey > grey.max() / 2) == (settings.masks_show == "tool")
    if recording.depth:
        steps = np.stack([view.depth(recording.depth(i)) for i in kept])
        depth = (steps * settings.depth_unit).astype(np.float32)
    if recording.right:
        right = np.stack([view.colour(recording.right(i)) for i in kept])
    return Given(tool, depth, right, settings.baseline if len(right) else 0.0)


def _words(camera: Camera, frames: Frames, given: Given, repeat: int, more: bool) -> str:
    words = [f"{camera.frames} frames of {camera.width} x {camera.height} px at {camera.fps:g} fps"]
    words += [f"focal {camera.fx:.0f} px ({camera.focal_from})"]
    words += [f"given {name}" for name in ("tool", "depth", "right") if len(getattr(given, name))]
    words += [f"every frame was shown {repeat} times, kept once"] if repeat > 1 else []
    words += ["the rest is left out (ingest.max_frames)"] if more else []
    words += ["nothing moves in it: it can be reconstructed, but teaches no physics"] if is_still(frames.rgb) else []
    return "; ".join(words)
