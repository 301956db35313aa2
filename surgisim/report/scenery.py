"""The canonical scene and the thick body, from the camera and from where no camera was."""

import dataclasses

import numpy as np
from scipy.spatial.transform import Rotation

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.material import Material
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.scene import Scene
from surgisim.gaussians.attributes import drawn
from surgisim.gaussians.rasterise import render, to_bytes
from surgisim.report.charts.particles import particles
from surgisim.report.films import Film, joined
from surgisim.report.palette import HELD, MATERIAL, MOVED, gradient, mapped, rgb
from surgisim.report.story import Story
from surgisim.report.uri import jpeg
from surgisim.report.views import View, look, surface
from surgisim.side_by_side import in_order
from surgisim.skin import skin

WHITE = (1.0, 1.0, 1.0)


def scene_views(scene: Scene, camera: Camera, width: int) -> dict[str, str]:
    """Caption -> picture of the canonical Gaussians, turned about their middle."""
    zoom = width / camera.width
    fine = dataclasses.replace(
        camera,
        width=width,
        height=round(camera.height * zoom),
        fx=camera.fx * zoom,
        fy=camera.fy * zoom,
        cx=(camera.cx + 0.5) * zoom - 0.5,
        cy=(camera.cy + 0.5) * zoom - 0.5,
    )
    views = {"from the camera": (0, 0), "from 35° to the left": (35, 0), "from 40° above": (0, -40)}
    return {name: jpeg(turned(scene, fine, *angles)) for name, angles in views.items()}


def turned(scene: Scene, camera: Camera, yaw: float, pitch: float) -> np.ndarray:
    """The scene as a camera sees it that went round its middle by yaw and pitch [degrees], (H, W, 3) uint8."""
    mean, rotation, scale, opacity, color = drawn(scene)
    middle = np.median(mean, 0)
    turn = Rotation.from_euler("yx", [yaw, pitch], degrees=True)
    placed = turn.apply(mean - middle) + middle
    quaternion = (turn * Rotation.from_quat(rotation, scalar_first=True)).as_quat(scalar_first=True)
    return to_bytes(render(placed, quaternion, scale, opacity, color, camera, background=WHITE).rgb)


def colors(body: Body, material: Material) -> np.ndarray:
    """Particles' own colours, held ones marked, (P, 3) 0-255."""
    own = 255 * body.color.astype(float)
    return np.where(material.held[:, None], 0.35 * own + 0.65 * rgb(HELD), own)


def body_views(story: Story, size: tuple[int, int]) -> dict[str, str]:
    """Caption -> figure of the thick body."""
    run = story.run
    rest = run.body.rest.astype(float)
    unit = _unit(story)
    flank = look(rest, 90, 0, size)
    grips = tuple(zip(run.motion.center_rest, run.motion.radius, strict=True))
    cut = section(run.body, run.motion)
    away, below, sideways = f"away from the camera, z [{unit}]", f"down, y [{unit}]", f"right, x [{unit}]"
    views = {
        "from the camera": particles(
            rest,
            colors(run.body, story.material),
            story.skin,
            look(rest, 0, 0, size),
            across=sideways,
            down=below,
            grips=grips,
        ),
        "from the side": particles(rest, colors(run.body, story.material), story.skin, flank, across=away, down=below),
        "cut open at the grip": particles(
            rest, colors(run.body, story.material), skin(run.body, cut), flank, across=away, down=below, grips=grips
        ),
    }
    return views


def material_views(story: Story, size: tuple[int, int]) -> dict[str, str]:
    """Caption -> map of each parameter that varies over the body by more than 1 %."""
    run, found = story.run, {}
    rest = run.body.rest.astype(float)
    for name, column in zip(story.material.names, story.material.values.T, strict=True):
        low, high = np.percentile(column, [1, 99])
        if high - low <= 0.01 * abs(column.mean()):
            continue
        law, _, parameter = str(name).partition(".")
        unit = run.physics.terms.get(law, {}).get(parameter, {}).get("unit", "1")
        found[str(name)] = particles(
            rest,
            mapped(column, low, high, MATERIAL).astype(float),
            story.skin,
            look(rest, 0, 0, size),
            across=f"right, x [{_unit(story)}]",
            down=f"down, y [{_unit(story)}]",
            bar=(MATERIAL, float(low), float(high), f"{name} [{unit}]"),
        )
    return found


def section(body: Body, motion: Motion) -> np.ndarray:
    """Particles in a slab through the grip, or through the middle, (P,) bool."""
    x = body.rest[:, 0]
    at = motion.center_rest[0, 0] if len(motion.radius) else np.median(x)
    return np.abs(x - at) <= 1.25 * body.spacing


def side_film(story: Story, size: tuple[int, int], **how) -> Film:
    """The replay from where no camera was: turned, and cut open with its displacement in colour."""
    run = story.run
    rest, position = run.body.rest.astype(float), run.replay.position.astype(float)
    moved = np.linalg.norm(position - rest, axis=-1)
    top = max(float(moved.max()), 1e-9)
    both = np.concatenate([rest, *position[:: max(len(position) // 8, 1)]])
    oblique, flank = look(both, 40, 25, size), look(both, 90, 0, size)
    cut = section(run.body, run.motion)
    panels = {
        "turned by 40° and lifted by 25°; held particles in pink": _frames(
            position, np.broadcast_to(colors(run.body, story.material), position.shape), story.skin, oblique
        ),
        "cut open at the grip, seen from the side: how far each particle has moved": _frames(
            position, mapped(moved, 0, top, MOVED).astype(float), skin(run.body, cut), flank
        ),
    }
    bar = (gradient(MOVED), "0", f"{1e3 * top:.1f}", f"displacement [{_unit(story)}]")
    return joined(panels, bar=bar, **how)


def _frames(position: np.ndarray, color: np.ndarray, faces: np.ndarray, view: View) -> np.ndarray:
    return np.stack(list(in_order(lambda p, c: surface(p, faces, c, view), zip(position, color, strict=True))))


def _unit(story: Story) -> str:
    return "mm" if story.run.camera.scale == "known" else "mm*"
