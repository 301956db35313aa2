"""The manipulation that would tell two candidates apart."""

from dataclasses import replace

import numpy as np

from surgisim.artifacts.motion import Motion
from surgisim.artifacts.verdict import PULLED
from surgisim.diagnosis.base import Base
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import places
from surgisim.diagnosis.hypothesis import ease
from surgisim.diagnosis.laws import IMPOSSIBLE, Law, respond
from surgisim.diagnosis.memo import Memo
from surgisim.estimation.trial import at_once

PULL, HOLD, REST = 0.6, 1.2, 0.8
"""How long a proposed pull takes, holds, and is watched after its release [s]."""


def separating(
    clip: Clip, base: Base, first: Law, second: Law, memo: Memo, names: tuple[str, str], rng, workers: int = 1
) -> str:
    """The pull, of a few, under which the two laws differ most, in words."""

    def moved(run: tuple[Clip, Law], _worker: int) -> np.ndarray | None:
        trial, law = run
        try:
            return respond(trial, base, replace(law, motion=None), memo)
        except IMPOSSIBLE:
            return None

    tried = pulls(clip, rng)
    trials = [_instead(clip, motion) for _, motion in tried]
    seen = at_once(moved, [(trial, law) for trial in trials for law in (first, second)], workers)
    differ = [
        (float(np.sqrt(((one - other) ** 2).sum(-1).mean())), text)
        for (text, _), one, other in zip(tried, seen[::2], seen[1::2], strict=True)
        if one is not None and other is not None
    ]
    if not differ:
        return f"None of the pulls tried can be simulated with both {names[0]} and {names[1]}."
    most, text = max(differ, key=lambda d: d[0])
    return f"{text}: {names[0]} and {names[1]} would then differ by {1e3 * most:.2g} mm RMS."


def _instead(clip: Clip, motion: Motion) -> Clip:
    """The same body under another motion, with nothing recorded of it."""
    recording, frames = clip.recording, motion.active.shape[1]
    shape = (len(recording.sigma), frames)
    unseen = np.full((*shape, 3), np.nan, np.float32)
    planned = replace(
        recording, motion=motion, points=unseen, visible=np.zeros(shape, bool), place=recording.attached(), split=None,
        doubts={},
    )  # fmt: skip
    return replace(clip, recording=planned, late=None, moved=np.zeros((len(clip.kept), frames, 3)))


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
            pull = f"pull {1e3 * length:.0f} mm {name} along ({along})"
            text = f"Grasp at {PULLED} ({at} mm), {pull}, hold {HOLD:g} s and release"
            result.append((text, motion))
    return result
