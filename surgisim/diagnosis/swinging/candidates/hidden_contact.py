"""A force the way weight pulls, or against it; none where nothing is known of weight."""

import math

import numpy as np

from surgisim.diagnosis.swinging.law import ALONG, ALWAYS, Frame, Law


def laws(f: Frame) -> list[Law]:
    if not f.down.any():
        return []

    def make(x):
        x_, y_, z_ = np.sign(x[0] or 1.0) * f.down
        yaw, pitch = math.atan2(x_, z_), math.asin(np.clip(y_, -1.0, 1.0))
        told = {"force": max(abs(x[0]), 1e-6), "yaw": yaw, "pitch": pitch, **ALWAYS}
        return {"hidden_contact": told}, {"hidden_contact": f.point(x[1])}

    tried = tuple(f.weight * s for s in (-0.2, 0.1, 0.4, 1.0))
    return [Law("hidden_contact", make, (tried, ALONG), (-3 * f.weight, 0.0), (3 * f.weight, 1.0))]
