"""One run as one HTML file."""

import re
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib.resources import files

import jinja2
import numpy as np

from surgisim.report import overlay
from surgisim.report.contact import contact, depth_picture, tracked_picture
from surgisim.report.distrust import distrust
from surgisim.report.films import Film, strip
from surgisim.report.headline import headline
from surgisim.report.made import Made
from surgisim.report.palette import DEPTH, PHASE, gradient
from surgisim.report.parameters import parameters
from surgisim.report.plots import plots
from surgisim.report.scenery import body_views, material_views, scene_views, side_film
from surgisim.report.story import Story
from surgisim.report.tables import grids, lists
from surgisim.side_by_side import in_order, together


def page(story: Story, made: Made | None = None, *, progress=lambda *_: None) -> bytes:
    """The report, UTF-8, with every picture and film inside."""
    width = story.settings.panel
    with ThreadPoolExecutor(1) as beside:
        progress(0, 5, "contact sheet")
        strips = beside.submit(films, story)
        if not together():
            strips.result()
        content = {"story": story, "cards": headline(story), "doubts": distrust(story), "rows": contact(story)}
        content["made"] = made
        progress(1, 5, "scene and body")
        content["scene"] = scene_views(story.run.scene, story.run.camera, width)
        content["body"] = body_views(story, (700, 600))
        content["materials"] = material_views(story, (700, 600))
        progress(2, 5, "curves and tables")
        content["plots"] = plots(story)
        content["parameters"] = parameters(story.run.physics, story.run.fit, story.metrics.values.get("physics", {}))
        content["grids"], content["lists"] = grids(story.metrics), lists(story.metrics)
        content["phase_colors"] = PHASE
        progress(4, 5, "films")
        content["films"] = strips.result()
    text = template("report.html.j2").render(**content)
    progress(5, 5, "written")
    return text.encode()


def template(name: str) -> jinja2.Template:
    """A template beside this file; everything put into it is escaped."""
    loader = jinja2.FunctionLoader(lambda part: files("surgisim.report").joinpath(part).read_text())
    place = jinja2.Environment(
        loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    place.filters["kept_together"] = kept_together
    return place.get_template(name)


def kept_together(text: str) -> str:
    """A number and its unit do not go on different lines."""
    return re.sub(r"(?<=\d) (?=(%|px|dB|mm|cm|s|ms|Pa|kPa|Hz)\b|%)", "\u00a0", text)


def films(story: Story) -> list[tuple[str, Film]]:
    """Title and film, in the order of the page."""
    run, settings, masks = story.run, story.settings, story.run.masks
    whole = range(run.camera.frames)
    beside = {"recording": run.frames.rgb, "reconstruction": run.rendered.rgb}
    if story.replayed:
        beside["replay of the fitted body"] = run.replay.rgb
    zoom = round(0.75 * settings.panel)
    low, high = story.depth_range
    unit = "mm" if run.camera.scale == "known" else "mm*"

    def seen() -> dict[str, Sequence[np.ndarray]]:
        return {
            "masks: instrument green, highlights orange": list(
                in_order(overlay.masks, zip(run.frames.rgb, masks.tool, masks.specular, masks.tissue, strict=True))
            ),
            "instrument taken out": run.inpainted.rgb,
            "depth": list(in_order(depth_picture, ((story, t, zoom) for t in whole))),
            "tracks and grasp": list(in_order(tracked_picture, ((story, t, zoom) for t in whole))),
        }

    box = (round(1.4 * settings.panel), settings.panel)
    bar = (gradient(DEPTH), f"{1e3 * low:.0f}", f"{1e3 * high:.0f}", f"depth along the view [{unit}]")
    how = {"fps": run.camera.fps, "quality": settings.quality, "paper": story.moments[len(story.moments) // 2]}
    made = {
        "Recorded, reconstructed, replayed": lambda: strip(beside, settings.panel, **how),
        "The replay from where no camera was": lambda: side_film(story, box, **how),
        "What the stages saw": lambda: strip(seen(), zoom, bar=bar, **how),
    }
    return list(zip(made, in_order(lambda film: film(), zip(made.values())), strict=True))
