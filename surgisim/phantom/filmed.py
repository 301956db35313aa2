"""Film tissue that conceals something, and write down what.

Scene, picture and effect are drawn by generators of their own, so that neither of the first tells of the last.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from surgisim.config.invent import InventClip
from surgisim.config.phantom import Phantom
from surgisim.phantom import block, case, instrument
from surgisim.phantom.blind import borne, told, with_effects
from surgisim.phantom.case import Case
from surgisim.phantom.clip import photograph, tool_at
from surgisim.phantom.family import draw_shown
from surgisim.phantom.folder import npz
from surgisim.phantom.follow import nodes
from surgisim.phantom.mixture import concealed
from surgisim.phantom.model import Model, of_mesh
from surgisim.phantom.ogrid import Mesh
from surgisim.phantom.scene import GRAVITY, Hold, Scene
from surgisim.phantom.video import encode

Progress = Callable[[float, float, str], None]
APART = 2e-3
"""Distance of the surface's points whose true paths are written down [m]."""
FITTED = 0.85
"""Share of the frames in which an effect must stand out; the graph holds out the rest."""
CLEAR = 1.3
"""Grip radii around a grip in which nobody reads anything of an effect."""


@dataclass(frozen=True)
class Filmed:
    clip: bytes
    """An mp4."""
    truth: bytes
    """truth.json: what is concealed, and the camera; names the digest of `tracks`."""
    tracks: bytes
    """truth.npz: paths of the surface without and with the effects, camera frame [m], (K, T, 3) float32."""


def name_of(seed: int, number: int) -> str:
    """What the graph calls the clip; tells nothing of the case."""
    return f"video-{seed}-{number}"


def film_concealed(settings: InventClip, progress: Progress | None = None) -> Filmed:
    """The case `settings.case` of `settings.seed`: the same bytes every time on one machine.

    Raises Problem when no place is found where the tissue bears the effect.
    """
    spacings = settings.spacing, settings.spacing_coarse
    picture = draw_shown(settings.seed, settings.case, spacings)
    drawn = case.invent(picture)
    scene, models, (plain, quick) = borne(scene_of(picture, drawn), spacings, progress, in_elements)
    drawn = replace(drawn, pull=scene.holds[0].pull)
    free = in_view(drawn, scene, plain)
    names = concealed(settings.seed, settings.case, tuple(settings.only), settings.faint)
    true, aims, model = with_effects(settings, models, names, (plain, quick), free, progress)
    positions = np.stack([x.copy() for x in nodes(model, progress, "moving the tissue to be filmed")])
    mesh = block.mesh(drawn.shape, drawn.grip, settings.spacing, hold_sides=False)
    frames, _ = photograph(picture, drawn, mesh, np.arange(scene.frames) / scene.fps, positions, progress)
    tracks = npz(plain=plain.astype(np.float32), true=true.astype(np.float32))
    name = f"{name_of(settings.seed, settings.case)}.main"
    truth = told(settings, scene, name, aims, (plain, true), free, tracks) | {"camera": _camera(drawn)}
    text = json.dumps(truth, indent=1, allow_nan=False) + "\n"
    return Filmed(encode(frames, picture.fps, picture.crf), text.encode(), tracks)


def scene_of(picture: Phantom, drawn: Case) -> Scene:
    """The clip's tissue, its one pull and the surface's points, as effects are applied to."""
    line, shape = drawn.timeline, drawn.shape
    begin, arrive, release = (round(at * picture.fps) for at in (line.pull, line.hold, line.release))
    frames = round(picture.duration * picture.fps)
    counts = np.maximum(np.rint((shape.high - shape.low) / APART).astype(int), 2) + 1
    axes = [np.linspace(low, high, n) for low, high, n in zip(shape.low, shape.high, counts, strict=True)]
    return Scene(
        shape,
        drawn.law,
        (Hold(drawn.grip, drawn.pull, begin, arrive, release),),
        frames,
        picture.fps,
        round(FITTED * frames),
        GRAVITY * shape.axes[2],
        np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 2),
    )


def in_elements(scene: Scene, spacing: float) -> Model:
    """The scene with nothing concealed, in the elements that are filmed, of about `spacing` [m]."""
    made = block.mesh(scene.shape, scene.holds[0].grip, spacing, hold_sides=False)
    return of_mesh(scene, Mesh(made.points, made.uv, made.cells, made.fixed, made.gripped[None], made.upper))


def in_view(drawn: Case, scene: Scene, plain: np.ndarray) -> np.ndarray:
    """Which points at `plain` [m], (K, T, 3), are in the picture, not before the tool and clear of the grip, (K, T)."""
    view = drawn.view
    pixel = view.project(plain)
    inside = (pixel > 0).all(-1) & (pixel < [view.width - 1, view.height - 1]).all(-1)
    away = np.linalg.norm(plain[:, 0] - scene.shape.upper(drawn.grip.uv), axis=-1)
    inside &= (away > CLEAR * drawn.grip.radius)[:, None]
    for t in range(scene.frames):
        at = plain[:, t]
        inside[:, t] &= instrument.cast(tool_at(drawn, t / scene.fps), at / at[:, 2:])[0] > at[:, 2]
    return inside


def _camera(drawn: Case) -> dict[str, float]:
    """The pinhole that filmed it [px]."""
    view, (cx, cy) = drawn.view, drawn.view.center
    return {"width": view.width, "height": view.height, "focal": view.focal, "cx": cx, "cy": cy}
