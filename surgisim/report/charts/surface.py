"""A scene's surface as its field moves it, and its splats at rest: what a simulation takes over."""

import matplotlib
import numpy as np
from matplotlib.collections import EllipseCollection
from scipy.spatial.transform import Rotation
from scipy.special import expit

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.scene import Scene
from surgisim.measure.groups.scene_geometry import OPAQUE, surface_moved
from surgisim.measure.run import OfScene
from surgisim.report.charts.paper import png, sheet
from surgisim.report.palette import ERROR, REPLAY

MOST_STRAIN = 0.6
"""Strain at the colours' upper end [1]."""
TURNED = "#00ffff"
"""What is turned over."""
WINDOW = 0.3
"""Side of the part whose splats are drawn one by one [of the picture's]."""


def surface(run: OfScene, title: str = "") -> bytes:
    """PNG: neighbours' strain in the frame in which most is turned over, what is turned over, and splats at rest where
    most of that comes from."""
    moved, camera = surface_moved(run), run.camera
    with sheet(12.0, 0.6 + 5.2 * camera.height / camera.width) as figure:
        left, right = figure.subplots(1, 2)
        for axes in (left, right):
            axes.set_aspect("equal")
            axes.set_axis_off()
        if moved is None:
            left.set_title(f"{title}: too few opaque splats to have neighbours")
            return png(figure)
        # What is turned over last, on top of what it lies in.
        order = np.argsort(moved.turned, kind="stable")
        strain = np.ma.masked_where(moved.turned, moved.apart[moved.corners].mean(1))[order]
        colors = matplotlib.colormaps[ERROR].with_extremes(bad=TURNED)
        shown = left.tripcolor(
            *moved.pixel.T, moved.corners[order], facecolors=strain, cmap=colors, vmin=0, vmax=MOST_STRAIN,
            linewidth=0, antialiased=False,
        )  # fmt: skip
        left.set(xlim=(-0.5, camera.width - 0.5), ylim=(camera.height - 0.5, -0.5))
        left.set_title(
            f"{title}, frame {moved.worst}: {moved.turned.mean():.1%} turned over (blue)\n"
            f"strain in all frames up to {np.percentile(moved.strain, 95):.2f} (95 %)"
        )
        figure.colorbar(shown, ax=left, shrink=0.7, label="mean strain of neighbours [1]")
        _splats(right, run.scene, camera, _middle(run.scene, camera, moved))
        return png(figure)


def _middle(scene: Scene, camera: Camera, moved) -> np.ndarray:
    """Where at rest most of what is turned over comes from [px], (2,)."""
    rest = camera.project(scene.mean[expit(scene.opacity) > OPAQUE].astype(float))
    return np.median(rest[moved.corners[moved.turned]].reshape(-1, 2) if moved.turned.any() else rest, axis=0)


def _splats(axes, scene: Scene, camera: Camera, middle: np.ndarray) -> None:
    """One-sigma ellipses of the opaque splats in a window."""
    width, height = WINDOW * camera.width, WINDOW * camera.height
    x0, y0 = (middle - [width / 2, height / 2]).clip(0, [camera.width - width, camera.height - height])
    mean, radius = scene.mean.astype(float), np.exp(scene.scale.astype(float))
    place = camera.project(mean)
    near = (abs(place - [x0 + width / 2, y0 + height / 2]) < [width / 2, height / 2]).all(1)
    near &= (expit(scene.opacity) > OPAQUE) & (mean[:, 2] > 0)
    turn = Rotation.from_quat(scene.rotation[near][:, [1, 2, 3, 0]].astype(float)).as_matrix()
    x, y, z = mean[near].T
    slope = np.zeros((len(z), 2, 3))
    slope[:, 0, 0], slope[:, 0, 2] = camera.fx / z, -camera.fx * x / z**2
    slope[:, 1, 1], slope[:, 1, 2] = camera.fy / z, -camera.fy * y / z**2
    factor = slope @ (turn * radius[near][:, None])
    axis, way, _ = np.linalg.svd(factor)
    angle = np.degrees(np.arctan2(axis[:, 1, 0], axis[:, 0, 0]))
    color = scene.color[near].clip(0, 1)
    axes.add_collection(
        EllipseCollection(
            2 * way[:, 0], 2 * way[:, 1], angle, units="xy", offsets=place[near], offset_transform=axes.transData,
            facecolors=color, edgecolors=REPLAY, linewidths=0.4,
        )
    )  # fmt: skip
    axes.set(xlim=(x0, x0 + width), ylim=(y0 + height, y0))
    side = np.ptp(np.percentile(mean, [0.5, 99.5], axis=0), axis=0).max()
    longest = radius.max(1)
    axes.set_title(
        f"splats there, at rest\nof all {len(mean):,} the largest is {longest.max() / side:.1%} of the scene, "
        f"the thinnest 1 : {(longest / radius.min(1)).max():.1f}"
    )
