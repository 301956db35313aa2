"""A scene's attributes as stored (logits and logarithms) and as drawn."""

import numpy as np
from scipy.special import expit, logit

from surgisim.artifacts.scene import Scene


def drawn(scene: Scene) -> tuple[np.ndarray, ...]:
    """mean [m], rotation, scale [m], opacity 0-1 and color 0-1, in the order `rasterise` and `render` want."""
    return scene.mean, scene.rotation, np.exp(scene.scale), expit(scene.opacity), scene.color


def stored(mean: np.ndarray, rotation: np.ndarray, scale: np.ndarray, opacity: np.ndarray, color: np.ndarray) -> Scene:
    """The Scene of what is drawn: radii [m] > 0, opacities inside 0-1, quaternions of any length."""
    unit = rotation / np.linalg.norm(rotation, axis=1, keepdims=True)
    columns = mean, logit(opacity), np.log(scale), unit, color
    mean, opacity, scale, rotation, color = (np.asarray(c, np.float32) for c in columns)
    return Scene(mean=mean, opacity=opacity, scale=scale, rotation=rotation, color=color)
