"""The curves of a report: which lines go into which chart."""

import numpy as np

from surgisim.measure.carried import carried
from surgisim.measure.psnr import psnr
from surgisim.measure.slices import liveliest_column, slice_yt
from surgisim.report.charts.cost import cost
from surgisim.report.charts.energy import energy
from surgisim.report.charts.fit import field, fit
from surgisim.report.charts.history import history
from surgisim.report.charts.over_time import Line, over_time
from surgisim.report.charts.paper import photograph, png
from surgisim.report.charts.slices import slices
from surgisim.report.palette import RECONSTRUCTION, RECORDING, REPLAY, STILL
from surgisim.report.story import Story


def plots(story: Story) -> dict[str, str | None]:
    """Name -> figure; None where there is nothing to draw."""
    run = story.run
    return {
        "history": history(story.run.deformation.history) if len(story.run.deformation.history) > 1 else None,
        "psnr": _psnr(story),
        "error": _error(story),
        "movement": _movement(story),
        "energy": energy(run.replay, _phase_of(story, len(run.replay.time))),
        "fit": fit(run.fit.history),
        "field": field(run.fit.history),
        "cost": cost(story.metrics.stages),
        "slices": slices(*_slices(story), photograph),
    }


def _psnr(story: Story) -> str | None:
    lines = []
    for group, name, color in (("reconstruction", "reconstruction", RECONSTRUCTION), ("simulation", "replay", REPLAY)):
        values = story.series(group, "psnr_between")
        if values is not None:
            lines.append(Line(name, values, color))
    if not lines:
        return None
    first = story.run.inpainted.rgb[0]
    frames, tissue = story.run.frames.rgb, story.run.masks.tissue
    still = np.array([psnr(first, f, m) for f, m in zip(frames, tissue, strict=True)])
    lines.append(Line("first frame held still", np.where(np.isfinite(still), still, np.nan), STILL, True, False))
    return over_time(lines, "PSNR on tissue [dB]", story.time, story.phase, story.run.frames.split)


def _error(story: Story) -> str | None:
    for kind, words in (("true", "true"), ("tracked", "tracked")):
        values = story.series("simulation", f"{kind}_held_out_moving_px")
        if values is None:
            continue
        lines = [Line(f"replay, against {words} points", values, REPLAY)]
        still = story.series("simulation", f"{kind}_held_out_moving_still_px")
        if still is not None:
            lines.append(Line("if nothing moved", still, STILL, True, False))
        label = "error of moving points, mean [px]"
        return over_time(lines, label, story.time, story.phase, story.run.frames.split, from_zero=True)
    return None


def _movement(story: Story) -> str | None:
    """How far the liveliest points went, recorded and replayed: where a rebound shows."""
    run, tracks = story.run, story.run.tracks
    if len(run.replay.time) != run.camera.frames or not len(tracks.xy):
        return None
    path = carried(run.replay, run.body, np.where(tracks.visible[:, :1], tracks.xyz[:, 0], np.nan))
    on_body = np.isfinite(path).all((1, 2))
    way = np.linalg.norm(tracks.xy - tracks.xy[:, :1], axis=-1)
    way = np.where(tracks.visible, way, np.nan)
    often = on_body & (tracks.visible.mean(1) > 0.5)
    if not often.any():
        return None
    reach = np.where(often, np.nanmax(np.where(np.isfinite(way), way, 0), 1), -1)
    best = np.argsort(-reach, kind="stable")[: max(5, int(0.05 * often.sum()))]
    best = best[reach[best] > 0]
    if not len(best):
        return None
    pixels = run.camera.project(path[best])
    replayed = np.linalg.norm(pixels - pixels[:, :1], axis=-1)
    seen = np.isfinite(way[best])
    count = np.maximum(seen.sum(0), 1)
    enough = seen.sum(0) >= 2
    recorded = np.where(enough, np.where(seen, way[best], 0).sum(0) / count, np.nan)
    replay = np.where(enough, np.where(seen, replayed, 0).sum(0) / count, np.nan)
    lines = [Line("recording (tracks)", recorded, RECORDING, marked=False), Line("replay", replay, REPLAY)]
    return over_time(lines, "displacement [px]", story.time, story.phase, run.frames.split, from_zero=True)


def yt_slices(story: Story) -> bytes:
    """The Y-T slices as a figure of their own, PNG."""
    return slices(*_slices(story), png)


def _slices(story: Story) -> tuple[dict[str, np.ndarray], float, list[float]]:
    """Slices by name, the clip's duration [s], and where its phases end [s]."""
    run = story.run
    column = story.settings.column
    column = liveliest_column(run.frames.rgb, run.masks.tissue) if column is None else min(column, run.camera.width - 1)
    pictures = {f"recording, x = {column} px": slice_yt(run.frames.rgb, column)}
    pictures["reconstruction"] = slice_yt(run.rendered.rgb, column)
    if story.replayed:
        pictures["replay"] = slice_yt(run.replay.rgb, column)
    changes = np.flatnonzero(story.phase[1:] != story.phase[:-1]) + 1
    ends = [float(story.time[t]) for t in changes]
    return pictures, run.camera.frames / run.camera.fps, ends


def _phase_of(story: Story, count: int) -> np.ndarray:
    """The phases, continued for a replay longer than the recording."""
    if count <= len(story.phase):
        return story.phase[:count]
    return np.append(story.phase, np.full(count - len(story.phase), story.phase[-1]))
