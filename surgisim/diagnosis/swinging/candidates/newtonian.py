"""Viscosity."""

import math

from surgisim.diagnosis.swinging.law import Frame, Law

BASE = DAMPS = True


def laws(f: Frame) -> list[Law]:
    unit = f.E * f.period / (2 * math.pi)
    tried = tuple(unit * loss for loss in (0.015, 0.05, 0.15))
    return [Law("newtonian", lambda x: ({"newtonian": {"eta": x[0]}}, {}), (tried,), (1e-3 * unit,), (unit,))]
