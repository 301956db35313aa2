"""Resistance of what surrounds the body."""

import math

from surgisim.diagnosis.swinging.law import Frame, Law

DAMPS = True


def laws(f: Frame) -> list[Law]:
    tried = tuple(2 * math.pi / f.period * s for s in (0.02, 0.1, 0.5))
    return [Law("drag", lambda x: ({"drag": {"c": x[0]}}, {}), (tried,), (0.01,), (1e3,))]
