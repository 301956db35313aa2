"""When the tissue rests, is loaded, held and let go."""

from typing import Literal, get_args

import numpy as np

from surgisim.artifacts.motion import Motion

Phase = Literal["rest", "load", "hold", "released"]
PHASES: tuple[str, ...] = get_args(Phase)


def phases(motion: Motion, *, still: float = 0.05) -> np.ndarray:
    """Phase of each frame, (T,) str.

    A frame loads when a holding grip moves faster than `still` times its fastest; a hold is any
    later frame with a grip; all is at rest before the first load, and released without a grip after one.
    """
    j, count = motion.active.shape
    held = motion.active.any(0)
    loading = np.zeros(count, bool)
    for i in range(j):
        speed = np.zeros(count)
        speed[1:] = np.linalg.norm(np.diff(motion.position[i], axis=0), axis=-1)
        speed[~motion.active[i]] = 0
        loading |= speed > still * max(speed.max(initial=0), 1e-12)
    loaded, after = np.cumsum(loading) > 0, np.cumsum(held) > 0
    return np.select([loading & held, held & loaded, after & ~held], ["load", "hold", "released"], "rest")
