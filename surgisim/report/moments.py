"""The few frames that tell the clip's story."""

import numpy as np

from surgisim.artifacts.motion import Motion
from surgisim.measure.grasp_error import release


def moments(motion: Motion, count: int) -> list[int]:
    """`count` frames in order: rest, the middle of the pull, its farthest, after the release, the end."""
    frames = motion.active.shape[1]
    wanted = [0, frames - 1]
    if len(motion.radius):
        grip = int(np.argmax(np.linalg.norm(motion.position - motion.center_rest[:, None], axis=-1).max(1)))
        held = motion.active[grip]
        way = np.where(held, np.linalg.norm(motion.position[grip] - motion.center_rest[grip], axis=-1), 0)
        top = int(np.argmax(way))
        half = int(np.argmax(way >= 0.5 * way.max()))
        soon = min(release(held) + 2, frames - 1)
        wanted = [0, half, top, soon, frames - 1]
    chosen = sorted(set(wanted))[:count]
    spread = [int(f) for f in np.linspace(0, frames - 1, 4 * count)]
    while len(chosen) < min(count, frames):
        # the frame that is furthest from all chosen ones
        chosen.append(max(spread + list(range(frames)), key=lambda f: (min(abs(f - c) for c in chosen), -f)))
    return sorted(chosen)
