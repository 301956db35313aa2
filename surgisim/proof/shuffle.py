"""Recordings whose paths are another case's: whoever still names the law has read it from something else."""

import dataclasses

import numpy as np

from surgisim.recordings.recording import Recording


def partner(case: int, cases: int, seed: int) -> int:
    """Whose paths a case gets: never its own, and every case gives its paths once."""
    if cases < 2:
        return case
    order = np.random.default_rng([seed, cases, *b"shuffle"]).permutation(cases)
    where = int(np.flatnonzero(order == case)[0])
    return int(order[(where + 1) % cases])


def shuffled(own: Recording, other: Recording) -> Recording:
    """`own` with the displacements of `other`: body, grips, clock and name stay, point by point by its number.

    A longer path is cut, a shorter one stands still at its end; points too many take the first ones' paths again.
    """
    k, frames = np.arange(len(own.points)) % len(other.points), np.minimum(np.arange(own.frames), other.frames - 1)
    moved = (other.points - other.attached()[:, None]).astype(float)[k][:, frames]
    visible = other.visible[k][:, frames]
    return dataclasses.replace(
        own,
        points=np.where(visible[..., None], own.attached()[:, None] + moved, np.nan).astype(np.float32),
        visible=visible,
        place=own.attached(),
    )
