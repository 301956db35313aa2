"""What a clip concealed, as its tracks could have shown it: at their points, in their frame, over their noise.

The inventor knows paths of the tissue's surface in metres, seen by a true camera. Tracks come from a camera of which
the focal length may be assumed and the scale arbitrary: what projects to the same pixel then lies at

    x' = s f / f' x,  y' = s f / f' y,  z' = s z          f: true focal length, f': that of the tracks [px]

with one scale s for the whole clip, the median of z' over z at the points in frame 0. Lengths are told in the tracks'
metres; so are forces, stresses and whatever else has a length in its unit, the density being the same in both.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial import Delaunay

from surgisim.artifacts.camera import Camera
from surgisim.problem import Problem
from surgisim.proof.truth import Truth
from surgisim.recordings.recording import Recording

LEAST = 4
"""Points of the tracks that must lie on the surface whose paths are known."""
POWERS = {
    "m": 1, "m/s^2": 1, "Pa s/m": 1, "Pa": 2, "Pa s": 2, "kg": 3, "N/m": 3, "N": 4,
}  # fmt: skip
"""How many times the scale multiplies a number of this unit, density and seconds being what they are; others stay."""
BASE = {"E": "Pa", "eta": "Pa s"}
"""Units of the base's numbers that have a length in them."""


def as_tracked(truth: Truth, recording: Recording, camera: Camera) -> Truth:
    """The truth with paths of the recording's points, (K, T, 3) [m], NaN off the known surface, and told in its scale.

    `snr` and `snr_held_out` are those of the tracks: RMS over visible samples of what the effect moves a point by over
    the point's noise, axis by axis. What they were over the noise that the inventor reckoned with is `snr_set`.
    Raises Problem where the truth is of no clip, or where fewer than LEAST points lie on its surface.
    """
    true = truth.told.get("camera")
    if not true:
        raise Problem("truth.json: tells no camera, so it is of no clip. Leave out --camera.")
    corners, weights = _on_surface(truth, recording, camera)
    plain, moved = (_at(paths[:, : recording.frames], corners, weights) for paths in (truth.plain, truth.true))
    known = np.isfinite(plain[:, 0, 2])
    if known.sum() < LEAST:
        raise Problem(
            f"recording {recording.name}: {known.sum()} of {len(known)} points lie on the surface that the truth "
            f"knows, {LEAST} are needed. Score files of one case."
        )
    scale = float(np.median(recording.attached()[known, 2] / plain[known, 0, 2]))
    wide = scale * true["focal"] * camera.width / camera.crop[2] / camera.fx
    stretch = np.array([wide, wide, scale])
    plain, moved = stretch * plain, stretch * moved
    told = _told(truth.told, stretch)
    told |= {"snr": _ratio(recording, moved - plain, (0, recording.fitted_until)), "snr_set": truth.told["snr"]}
    told |= {"snr_held_out": _ratio(recording, moved - plain, recording.held_out), "scale": scale}
    told |= {"noise": float(np.sqrt((recording.noise**2).mean()))}
    return replace(truth, told=told, plain=plain, true=moved)


def _on_surface(truth: Truth, recording: Recording, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Of each point the three nearest known ones around its pixel in frame 0, (K, 3), and weights; NaN off them."""
    true = truth.told["camera"]
    left, top, width, height = camera.crop
    shrink = np.array([camera.width / width, camera.height / height])
    # Pixel centres are whole numbers, so a resize moves them by half a pixel.
    pixels = (camera.project(recording.attached()) + 0.5) / shrink - 0.5 + [left, top]
    first = truth.plain[:, 0]
    at = first[:, :2] / first[:, 2:] * true["focal"] + [true["cx"], true["cy"]]
    sheet = Delaunay(at)
    triangle = sheet.find_simplex(pixels)
    base = sheet.transform[triangle]
    part = np.einsum("kij,kj->ki", base[:, :2], pixels - base[:, 2])
    weights = np.concatenate([part, 1 - part.sum(1, keepdims=True)], 1)
    weights[triangle < 0] = np.nan
    return sheet.simplices[triangle], weights


def _at(paths: np.ndarray, corners: np.ndarray, weights: np.ndarray) -> np.ndarray:
    return np.einsum("kc,kcti->kti", weights, paths[corners])


def _ratio(recording: Recording, difference: np.ndarray, span: tuple[int, int]) -> float:
    """RMS length of differences [m], (K, T, 3), over the noise along each axis; visible samples in frames `span`."""
    frames = slice(*span)
    over = recording.over_noise(difference)[:, frames]
    seen = recording.visible[:, frames] & np.isfinite(over).all(-1)
    return float(np.sqrt((over[seen] ** 2).sum(-1).mean())) if seen.any() else 0.0


def _told(told: dict[str, Any], stretch: np.ndarray) -> dict[str, Any]:
    """Places, numbers and base in the tracks' metres."""
    scale = float(stretch[2])
    base = {name: value * scale ** POWERS.get(BASE.get(name, ""), 0) for name, value in told["base"].items()}
    return told | {"effects": [_effect(effect, stretch) for effect in told["effects"]], "base": base}


def _effect(effect: dict[str, Any], stretch: np.ndarray) -> dict[str, Any]:
    scale, place = float(stretch[2]), effect["place"]
    if isinstance(place, dict):
        extent = place["extent"] and scale * place["extent"]
        place = place | {"center": (stretch * place["center"]).tolist(), "extent": extent}
    numbers = {
        name: entry | {"value": entry["value"] * scale ** POWERS[entry["unit"]]} if entry["unit"] in POWERS else entry
        for name, entry in effect["parameters"].items()
    }
    return effect | {"place": place, "parameters": numbers}
