"""Base and named laws predicted together: with a law in place, the base no longer has to make up for it."""

from dataclasses import replace

import numpy as np
from scipy.linalg import cho_solve

from surgisim.diagnosis.base import SPREAD, bounded, carried, simulate
from surgisim.diagnosis.errors import rms
from surgisim.diagnosis.laws import law_of, respond
from surgisim.mpm.simulator import Breakdown


def together(case, refits) -> np.ndarray:
    """Displacement of the points with these laws over the whole clip [m], (K, T, 3).

    The base moves to where the metric puts it once the laws' responses are taken off, and the engine runs both again.
    Where that is no better on the fitted frames, or breaks down, base and responses are added as they are.
    """
    clip, base, until = case.clip, case.base, case.clip.until
    plain = base.simulated + sum(r.response for r in refits)
    first = refits[0].x
    if len(refits) == 1 and first is not None:
        # Law and base were fitted in the same runs.
        return plain
    left = case.z - sum(case.whiten(r.response[:, :until]) for r in refits)
    likely = cho_solve(case.space.factor, case.space.seen_through(left))[case.slopes]
    x = bounded((base.x if first is None else first) + likely * SPREAD, clip)
    try:
        drive, run = simulate(base.prepared, clip, x, case.memo, clip.frames)
        simulated = carried(base.prepared.simulator.carry(clip.rest), run)
        moved = replace(base, x=x, drive=drive, run=run, simulated=simulated)
        laws = [law_of(r.finding.hypothesis, r.amplitude, clip) for r in refits]
        both = simulated + sum(respond(clip, moved, law, case.memo) - simulated for law in laws)
    except Breakdown:
        return plain
    return both if rms(case, both)[0] < rms(case, plain)[0] else plain
