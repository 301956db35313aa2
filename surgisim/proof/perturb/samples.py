"""Fewer samples: some lost, every second frame, half of the points."""

import dataclasses

import numpy as np

from surgisim.recordings.recording import Recording

RUN = (2, 13)
"""Shortest run of frames in which a point is lost, and one more than the longest."""


def lost(recording: Recording, rng: np.random.Generator, share: float) -> Recording:
    """This share of the visible samples lost [1], half of them one by one, half in runs; frame 0 stays."""
    visible = recording.visible.copy()
    total = round(share * visible[:, 1:].sum())
    left = total
    while left > total / 2:
        k, t = rng.integers(len(visible)), rng.integers(1, recording.frames)
        run = np.flatnonzero(visible[k, t : t + rng.integers(*RUN)])[: left - total // 2] + t
        visible[k, run] = False
        left -= len(run)
    points, frames = np.nonzero(visible[:, 1:])
    chosen = rng.choice(len(points), left, replace=False)
    visible[points[chosen], frames[chosen] + 1] = False
    return dataclasses.replace(
        recording, visible=visible, points=np.where(visible[..., None], recording.points, np.float32(np.nan))
    )


def half_frames(recording: Recording) -> Recording:
    """Every second frame, at half the rate."""
    motion, split = recording.motion, recording.split
    if split is not None:
        split = {name: ((first + 1) // 2, (last + 1) // 2) for name, (first, last) in split.items()}
    return dataclasses.replace(
        recording,
        fps=recording.fps / 2,
        points=recording.points[:, ::2],
        visible=recording.visible[:, ::2],
        motion=dataclasses.replace(motion, position=motion.position[:, ::2], active=motion.active[:, ::2]),
        # A point that is first seen in a frame left out must not begin elsewhere.
        place=recording.place,
        split=split,
    )


def half_points(recording: Recording, rng: np.random.Generator) -> Recording:
    """Half of the points, by chance."""
    count = len(recording.points)
    kept = np.sort(rng.choice(count, max(count // 2, 1), replace=False))
    return recording.of(kept)
