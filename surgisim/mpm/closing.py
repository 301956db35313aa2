"""Grips that close on tissue wherever they find it.

Tissue that has sagged, or breathes, is not where it was at rest when jaws close on it: they carry it along from there.
A path that is zero where its grip closes counts from that place; one that is not says by itself where tissue is held.
"""

from dataclasses import replace

import numpy as np

from surgisim.mpm.grip import Drive
from surgisim.mpm.simulator import Run, Simulator

ZERO = 1e-5
"""Length below which a path counts as zero [m]."""


def follow(
    simulator: Simulator, theta: np.ndarray, drive: Drive, *, before: Run | None = None, first: int = 0, last: int
) -> Run:
    """As `Simulator.run` from frame `first` to `last`, each grip's path shifted to where it finds its tissue.

    before: the run up to `first`, whose memory is not taken over; rest if None. A grip's shift is the mean
    displacement of what it holds, in the frame in which it closes. Raises Breakdown as `Simulator.run` does.
    """
    closing = sorted({frame for _, frame, _ in closings(drive)})
    for frame in closing:
        if before is not None and frame <= first:
            drive = shifted(simulator, drive, frame, before.u[frame])
    parts, begin, at = [], None if before is None else before.state(first)[:2], first
    for stop in [*(f for f in closing if first < f < last), last]:
        part = simulator.run(theta, drive, begin=begin, first=at, last=stop)
        parts.append(part if not parts else Run(part.u[1:], part.v[1:], part.q[1:]))
        drive, begin, at = shifted(simulator, drive, stop, part.u[-1]), part.state(-1), stop
    return Run(*(np.concatenate([getattr(p, name) for p in parts]) for name in ("u", "v", "q")))


def closings(drive: Drive) -> list[tuple[int, int, int]]:
    """Anchor, frame in which it closes, and step at which it opens; only where it closes later than the first frame."""
    found = []
    for anchor in range(1, len(drive.hold)):
        on = np.concatenate([[False], drive.hold[anchor] > 0, [False]])
        begins, ends = np.flatnonzero(on[1:] & ~on[:-1]), np.flatnonzero(~on[1:] & on[:-1])
        found += [(anchor, int(b) // drive.per_frame, int(e)) for b, e in zip(begins, ends, strict=True) if b]
    return found


def shifted(simulator: Simulator, drive: Drive, frame: int, u: np.ndarray) -> Drive:
    """The drive with the paths of grips that close in `frame` shifted to their tissue; u of nodes [m], (A, 3)."""
    path, step = drive.path.copy(), frame * drive.per_frame
    for anchor, begin, end in closings(drive):
        if begin == frame and np.linalg.norm(path[anchor, step]) < ZERO:
            mine = (drive.member >> anchor & 1).astype(bool)
            weight = drive.share[mine] * simulator.volume_p[mine]
            found = simulator.carry(simulator.rest[mine]) @ u.astype(float)
            path[anchor, step : end + 1] += weight @ found / weight.sum()
    return replace(drive, path=path)
