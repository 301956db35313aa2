"""The named law as numbers that a simulation can use."""

from dataclasses import replace

import numpy as np

from surgisim.artifacts.physics import Physics
from surgisim.diagnosis import candidates, nuisance
from surgisim.diagnosis.base import Base, values_of
from surgisim.diagnosis.laws import law_of, steps
from surgisim.physics.catalogue import choose


def base_numbers(base: Base) -> dict:
    """E, nu and eta with 90 % intervals."""

    def numbers(x: np.ndarray) -> np.ndarray:
        return np.stack([np.exp(x[..., 0]), x[..., 1], np.exp(x[..., 0] + x[..., 2])], -1)

    best, ends = numbers(base.x[:3]), np.quantile(numbers(base.known.draws(base.x)), [0.05, 0.95], axis=0)
    told = zip(("E", "nu", "eta"), ("Pa", "1", "Pa s"), best, ends[0], ends[1], strict=True)
    return {
        name: {"value": float(v), "low": float(min(low, v)), "high": float(max(high, v)), "unit": unit}
        for name, unit, v, low, high in told
    }


def ratios(base: Base) -> dict:
    """eta / E with its 90 % interval: of tissue that creeps back it is told where neither number is."""
    low, high = np.exp(np.quantile(base.known.draws(base.x)[:, 2], [0.05, 0.95]))
    value = float(np.exp(base.x[2]))
    return {"eta / E": {"value": value, "low": min(float(low), value), "high": max(float(high), value), "unit": "s"}}


def physics(case, refits) -> Physics:
    """The base's laws and the named ones, with the grid on which their numbers hold and a stable step."""
    clip, base = case.clip, case.base
    if clip.error is not None:
        clip = clip.laid(share=nuisance.FINER * case.settings.grid)
    if refits and refits[0].x is not None:
        base = replace(base, x=refits[0].x[:3], known=refits[0].known or base.known)
    own, where, known = values_of(base.x), {}, base_numbers(base)
    values = dict(own)
    for r in refits:
        h, law = r.finding.hypothesis, law_of(r.finding.hypothesis, r.amplitude, clip)
        modelled = candidates.of(h).modelled
        mine = law.values if modelled is None else modelled(h, r.amplitude)
        if set(mine) & set(values):
            # A body has each law once: where the second effect needs the first one's again, the first stays.
            continue
        values |= mine
        where |= law.places
    prepared = clip.prepared(tuple(values))
    step = 1 / clip.fps / steps(clip, prepared, prepared.theta(values, where))
    places = {
        n: {
            "center": [float(c) for c in p.center],
            "extent": float(p.extent),
            "normal": None if p.normal is None else [float(c) for c in p.normal],
        }
        for n, p in where.items()
    }
    terms = {
        name: {
            key: {"value": float(value), "unit": term.params[key].unit}
            | {k: known[key][k] for k in ("low", "high") if name in own and key in known}
            for key, value in values[name].items()
        }
        for name, term in choose(values).items()
    }
    return Physics(
        terms=terms, density=float(clip.density), gravity=[0.0, 0.0, 0.0],
        grid={"spacing": float(clip.body.spacing), "step": float(step)}, places=places,
        ratios=ratios(base),
    )  # fmt: skip
