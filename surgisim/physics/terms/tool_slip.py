"""The grip slips: from an onset on, tissue follows only part of the way the instrument goes outward.

    dl/dt = w S((t - t0) / e) max(dp/dt . p/|p|, 0) p/|p|,   p <- p - l                      [m]
    S(x) = (1 + tanh x) / 2,   e = 0.02 s

p the path of a grip from where it took hold, l how far tissue lags behind [m], w the share of outward motion that
is lost [1], t0 the onset [s]. What has slipped does not come back while the grip holds: going in loses nothing and
going out again loses more, so the lag ratchets. Acts on every grip that moves after the onset.
A kinematic form, ours, of friction between jaw and tissue; a recording shows the way, not the force.
"""

from dataclasses import replace

import numpy as np

from surgisim.physics.catalogue import Param, Term

EDGE = 0.02
"""How fast slipping sets in [s]."""


def drive(path, slip, onset):
    time = (np.arange(path.steps) + 0.5) * path.step
    slipping = slip * 0.5 * (1 + np.tanh((time - onset) / EDGE))
    moved = path.path.copy()
    for a in range(1, len(moved)):
        way = moved[a].copy()
        away = np.linalg.norm(way, axis=1)
        # Outward at either end of a step: the first step from where the grip took hold has no direction before it.
        out = way[1:] / np.maximum(away[1:], np.finfo(float).tiny)[:, None]
        gained = np.maximum((np.diff(way, axis=0) * out).sum(1), 0) * (path.hold[a] > 0)
        moved[a, 1:] -= np.cumsum((slipping * gained)[:, None] * out, 0)
    return replace(path, path=moved)


TERM = Term(
    drive=drive,
    place="everywhere",
    params={
        "slip": Param("1", low=0.0, high=1.0, default=0.3, off=0.0, logarithmic=False),
        "onset": Param("s", low=0.0, high=60.0, default=0.2, logarithmic=False),
    },
)
