"""The manipulation that would tell two candidates apart."""

from dataclasses import replace

import numpy as np

from surgisim.artifacts.motion import Motion
from surgisim.diagnosis.base import Base
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import places
from surgisim.diagnosis.hypothesis import ease
from surgisim.diagnosis.laws import IMPOSSIBLE, Law, respond
from surgisim.diagnosis.memo import Memo

PULL, HOLD, REST = 0.6, 1.2, 0.8
"""How long a proposed pull takes, holds, and is watched after its release [s]."""


def separating(clip: Clip, base: Base, first: Law, second: Law, memo: Memo, names: tuple[str, str], rng) -> str:
    """The pull, of a few, under which the two laws differ most, in words."""
    best = None
    for text, motion in pulls(clip, rng):
        trial = _instead(clip, motion)
        try:
            seen = [respond(trial, base, replace(law, motion=None), memo) for law in (first, second)]
        except IMPOSSIBLE:
            continue
        differ = float(np.sqrt(((seen[0] - seen[1]) ** 2).sum(-1).mean()))
        if best is None or differ > best[0]:
            best = (differ, text)
    if best is None:
        return f"None of the pulls tried can be simulated with both {names[0]} and {names[1]}."
    return f"{best[1]}: {names[0]} and {names[1]} would then differ by {1e3 * best[0]:.2g} mm RMS."


def _instead(clip: Clip, motion: Motion) -> Clip:
    """The same body under another motion, with nothing recorded of it."""
    recording, frames = clip.recording, motion.active.shape[1]
    shape = (len(recording.sigma), frames)
    unseen = np.full((*shape, 3), np.nan, np.float32)
    planned = replace(
        recording, motion=motion, points=unseen, visible=np.zeros(shape, bool), place=recording.attached(), split=None
    )
    return replace(clip, recording=planned, moved=np.zeros((len(clip.kept), frames, 3)))


def pulls(clip: Clip, rng: np.random.Generator) -> list[tuple[str, Motion]]:
    """A few places and directions, each held and released."""
    centers = places(clip, depth=0.0)
    if not len(centers):
        return []
    far = centers[np.argsort(np.linalg.norm(centers - centers.mean(0), axis=1))]
    chosen = [far[0], far[len(far) // 2]]
    radius = float(clip.motion.radius.mean()) if len(clip.motion.radius) else 1.2 * clip.body.spacing
    length = 0.8 * radius
    time = np.arange(round((PULL + HOLD + REST) * clip.fps) + 1) / clip.fps
    side = np.cross(clip.normal, rng.standard_normal(3))
    side /= np.linalg.norm(side)
    result = []
    for center in chosen:
        for name, way in (("up", clip.normal), ("sideways", side)):
            path = center + ease(time / PULL)[:, None] * length * way
            active = (time <= PULL + HOLD)[None]
            motion = Motion(center[None], np.array([radius]), path[None], active, np.ones(1), "given")
            at = ", ".join(f"{1e3 * c:.0f}" for c in center)
            along = ", ".join(f"{c:.2f}" for c in way)
            text = (
                f"Grasp near ({at}) mm, pull {1e3 * length:.0f} mm {name} along ({along}), hold {HOLD:g} s and release"
            )
            result.append((text, motion))
    return result
