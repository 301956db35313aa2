"""Where held tissue is carried, in space."""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.depth import Depth
from surgisim.artifacts.motion import Motion
from surgisim.perception.grasp.contact import Contact
from surgisim.perception.grasp.find import Grip
from surgisim.perception.tracking import Paths
from surgisim.perception.tracking.between import sample

SHOWN = 3
"""Held points that must be seen for their way to be known."""


def carry(
    grips: list[Grip], paths: Paths, contacts: list[Contact | None], depth: Depth, camera: Camera, source: str
) -> Motion:
    """The grips as balls in the camera frame [m] and their ways.

    paths: tissue points about each grip, hidden ones too. contacts: each grip's instrument as they meet it, none if
    there is none. Behind the jaws the ball is carried by the ring of tissue around them that moves as one with it;
    where that is hidden too, by the instrument.
    """
    frames = paths.xy.shape[1]
    z = _depth_at(depth, paths.xy)
    center, radius, position, active = [], [], [], []
    for grip, contact in zip(grips, contacts, strict=True):
        rest_z = float(sample(depth.z[0].astype(np.float32), grip.center[None, None].astype(np.float32))[0, 0])
        held = np.linalg.norm(paths.xy[:, 0] - grip.center, axis=-1)
        ring = held <= max(grip.radius, np.sort(held)[min(8, len(held) - 1)])
        place, deep = _course(paths, z, ring, contact, grip)
        way = camera.lift(grip.center + place, rest_z + deep)
        rest = camera.lift(grip.center, np.array(rest_z))
        way[: grip.begin + 1] = rest
        way[grip.end + 1 :] = way[grip.end]
        center.append(rest)
        radius.append(grip.radius * rest_z / camera.fx)
        position.append(way)
        active.append((np.arange(frames) >= grip.begin) & (np.arange(frames) <= grip.end))
    count = len(grips)
    return Motion(
        center_rest=np.array(center).reshape(count, 3),
        radius=np.array(radius).reshape(count),
        position=np.array(position).reshape(count, frames, 3),
        active=np.array(active, bool).reshape(count, frames),
        confidence=np.array([g.confidence for g in grips]).reshape(count),
        source=source if count else "none",
    )


def _depth_at(depth: Depth, xy: np.ndarray) -> np.ndarray:
    """z under each path [m], (K, T)."""
    at = xy.swapaxes(0, 1)[:, :, None]
    return np.stack([sample(depth.z[t].astype(np.float32), at[t])[:, 0] for t in range(len(at))], 1)


def _course(
    paths: Paths, z: np.ndarray, ring: np.ndarray, contact: Contact | None, grip: Grip
) -> tuple[np.ndarray, np.ndarray]:
    """Displacement across [px], (T, 2), and along the view [m], (T,), of the held ball, smoothed in time."""
    moved = (paths.xy[ring] - paths.xy[ring, :1]).astype(float)
    deep = (z[ring] - z[ring, :1]).astype(float)
    seen = paths.visible[ring]
    frames = moved.shape[1]
    across, along = np.zeros((frames, 2)), np.zeros(frames)
    for t in range(frames):
        who = seen[:, t] if seen[:, t].sum() >= 3 else np.ones(ring.sum(), bool)
        across[t] = np.median(moved[who, t], axis=0)
        # The ball moves as one and measured depth is too smooth: the most displaced fifth is nearest the truth.
        along[t] = np.percentile(deep[who, t], 20 if np.median(deep[who, t]) < 0 else 80)
    if contact is not None:
        across = _with_tool(across, seen.sum(0) >= SHOWN, contact.mean_velocity(ring), grip)
    stretch = slice(grip.begin, grip.end + 1)
    across[stretch] = gaussian_filter1d(across[stretch], 0.7, axis=0, mode="nearest")
    along[stretch] = gaussian_filter1d(along[stretch], 1.5, axis=0, mode="nearest")
    # It begins at rest: what smoothing or noise put there fades out over the first frames.
    fade = np.exp(-np.arange(grip.end + 1 - grip.begin) / 2.0)
    across[stretch] -= fade[:, None] * across[grip.begin]
    along[stretch] -= fade * along[grip.begin]
    return across, along


def _with_tool(across: np.ndarray, shown: np.ndarray, tool: np.ndarray, grip: Grip) -> np.ndarray:
    """`across` (T, 2), moved on by the instrument's own steps (T, 2) [px] from where it was last `shown` (T,)."""
    out, last = across.copy(), grip.begin
    guessed = np.diff(across, axis=0, append=across[-1:])
    step = np.where(np.isfinite(tool), tool, guessed)
    for t in range(grip.begin + 1, grip.end + 1):
        out[t] = out[t - 1] + step[t - 1]
        if shown[t]:
            share = np.arange(last + 1, t + 1)[:, None] - last
            out[last + 1 : t + 1] += share / (t - last) * (across[t] - out[t])
            last = t
    return out
