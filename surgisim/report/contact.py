"""The contact sheet: what every stage made of the same few frames."""

from dataclasses import dataclass

import numpy as np

from surgisim.artifacts.inpainted import COPIED, INVENTED
from surgisim.report import overlay
from surgisim.report.palette import DEPTH, ERROR, gradient, mapped
from surgisim.report.story import Story
from surgisim.report.uri import jpeg

LARGEST_ERROR = 0.25
"""Colour difference that gets the brightest colour [1]."""


@dataclass(frozen=True)
class Row:
    stage: str
    what: str
    pictures: list[str]
    bar: tuple[str, str, str, str] | None = None
    """Colour bar: CSS gradient, low end, high end, label."""
    legend: tuple[tuple[str, str], ...] = ()
    """Colour and what it means."""


def contact(story: Story) -> list[Row]:
    run, at, width = story.run, story.moments, story.settings.cell
    recording = run.frames.rgb

    def row(stage, what, frames, **more):
        return Row(stage, what, [jpeg(overlay.enlarged(f, width)) for f in frames], **more)

    rows = [
        row("ingest", "recording", [recording[t] for t in at]),
        row(
            "masking",
            "instrument, highlights, and what may not be learned from (faded)",
            [overlay.masks(recording[t], run.masks.tool[t], run.masks.specular[t], run.masks.tissue[t]) for t in at],
            legend=((overlay.TOOL, "instrument"), (overlay.SPECULAR, "highlight")),
        ),
        row("inpainting", "instrument taken out", [run.inpainted.rgb[t] for t in at]),
        row(
            "inpainting",
            "where each pixel comes from",
            [_origin(run.inpainted.rgb[t], run.inpainted.origin[t]) for t in at],
            legend=(("#0072b2", "copied from another frame"), ("#d55e00", "invented: never seen")),
        ),
        _depth(story),
        Row("tracking", "tracked points and the grasp (circle; dashed once let go)", [_tracked(story, t) for t in at]),
        row("reconstruction", "the dynamic scene, redrawn", [run.rendered.rgb[t] for t in at]),
        _error(story, "reconstruction", run.rendered.rgb),
    ]
    if story.replayed:
        rows.append(row("simulation", "replay of the fitted body", [run.replay.rgb[t] for t in at]))
        rows.append(_error(story, "simulation", run.replay.rgb))
    return rows


def depth_picture(story: Story, t: int, width: int) -> np.ndarray:
    return overlay.enlarged(mapped(story.run.depth.z[t], *story.depth_range, DEPTH), width)


def tracked_picture(story: Story, t: int, width: int) -> np.ndarray:
    """Tracks and grips over the frame at `width` [px]."""
    run, zoom = story.run, width / story.run.camera.width
    picture = overlay.tracks(run.frames.rgb[t], run.tracks.xy, run.tracks.visible, t, width)
    for j in range(len(run.motion.radius)):
        place = run.motion.position[j, t] if run.motion.active[j].any() else run.motion.center_rest[j]
        center = (run.camera.project(place) + 0.5) * zoom - 0.5
        radius = run.camera.fx * run.motion.radius[j] / place[2] * zoom
        overlay.grip(picture, center, float(radius), bool(run.motion.active[j, t]))
    return picture


def _tracked(story: Story, t: int) -> str:
    return jpeg(tracked_picture(story, t, story.settings.cell))


def _depth(story: Story) -> Row:
    low, high = story.depth_range
    unit = "mm" if story.run.camera.scale == "known" else "mm, arbitrary scale"
    bar = (gradient(DEPTH), f"{1e3 * low:.0f}", f"{1e3 * high:.0f}", f"depth along the view [{unit}]")
    pictures = [jpeg(depth_picture(story, t, story.settings.cell)) for t in story.moments]
    return Row("depth", "distance from the camera", pictures, bar=bar)


def _error(story: Story, stage: str, drawn: np.ndarray) -> Row:
    run, pictures = story.run, []
    for t in story.moments:
        apart = np.abs(drawn[t].astype(float) - run.frames.rgb[t]).mean(-1) / 255
        apart[~run.masks.tissue[t]] = np.nan
        pictures.append(jpeg(overlay.enlarged(mapped(apart, 0, LARGEST_ERROR, ERROR), story.settings.cell)))
    bar = (gradient(ERROR), "0", f"≥ {LARGEST_ERROR}", "mean difference of the colours [1 = black to white]")
    return Row(stage, "its difference from the recording; what is not compared is grey", pictures, bar=bar)


def _origin(frame: np.ndarray, origin: np.ndarray) -> np.ndarray:
    grey = np.repeat((0.5 * frame.mean(-1, keepdims=True) + 0.5 * 255).astype(np.uint8), 3, -1)
    return overlay.tinted(overlay.tinted(grey, origin == COPIED, "#0072b2", 0.7), origin == INVENTED, "#d55e00", 0.7)
