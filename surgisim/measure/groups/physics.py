"""What the fit says of the tissue and the grips, beside what is true of them."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.stats import binomtest

from surgisim.measure.groups.depth import scale_to_truth
from surgisim.measure.number import number
from surgisim.measure.run import Run
from surgisim.measure.truth_seen import TruthSeen


def physics(run: Run) -> dict[str, dict[str, Any]]:
    """Every number of the fit with its 90 % interval and whether it is told; on an invented clip with the true one.

    Where the recording's scale is arbitrary, lengths and what goes with them are brought to the truth's by the one
    factor of the clip before they are compared: densities and times are known, lengths are not.
    """
    scale = scale_to_truth(run)
    true = dict(_true(run, run.truth)) if run.truth else {}
    entries = {}
    for name, found in run.fit.identifiability.items():
        factor = scale ** _power(found["unit"])
        how = "estimation's own value, with its 90 % interval"
        how += f"; times {factor:.4g}, the clip's one factor of length to the power of the unit" if factor != 1 else ""
        entry = number(factor * found["value"], found["unit"], how)
        if entry["value"] is not None:
            entry |= {"low": factor * found["low"], "high": factor * found["high"], "told": found["told"]}
            if name in true:
                inside = entry["low"] <= true[name] <= entry["high"]
                entry |= {"true": float(true[name]), "inside": bool(inside)}
        entries[name] = entry
    told = [e for e in entries.values() if "inside" in e and e["told"]]
    if told:
        inside = sum(e["inside"] for e in told)
        how = f"of {len(told)} numbers that are told and whose truth is known, the share inside their 90 % intervals"
        # Wilson, Probable inference, the law of succession, and statistical inference, JASA 22 (1927).
        ends = binomtest(inside, len(told)).proportion_ci(0.9, "wilson")
        entries["told_inside"] = number(inside / len(told), "1", how + "; Wilson's 90 % interval")
        entries["told_inside"] |= {"low": float(ends.low), "high": float(ends.high), "count": len(told)}
    return entries


def _power(unit: str) -> int:
    """How a number of this unit goes with the length of the scene, where densities and times are known."""
    return {"m": 1, "Pa": 2, "Pa s": 2}.get(unit, 0)


def _true(run: Run, truth: TruthSeen) -> Iterator[tuple[str, float]]:
    """Names as the fit has them, and what is true."""
    known = truth.parameters
    elastic = next((law for law in known.values() if isinstance(law, dict) and "E" in law), None)
    for law in run.physics.terms:
        if elastic and "E" in run.physics.terms[law]:
            yield f"{law}.E", elastic["E"]
            yield f"{law}.nu", elastic["nu"]
            if "newtonian" in known:
                yield f"newtonian.eta / {law}.E", known["newtonian"]["eta"] / elastic["E"]
    if "newtonian" in known:
        yield "newtonian.eta", known["newtonian"]["eta"]
    if "thickness" in known:
        yield "held.depth", known["thickness"] * _along_the_view(run, truth)
    for j, held in enumerate(truth.motion.active):
        on = np.flatnonzero(held)
        if len(on) and j < len(run.motion.radius):
            way = truth.motion.position[j, on[-1]] - truth.motion.position[j, 0]
            yield f"grip {j}.toward", float(way[2])
            yield f"grip {j}.radius", float(truth.motion.radius[j])
            if "timeline" in known and on[-1] < held.size - 1:
                found = np.flatnonzero(run.motion.active[j])
                yield f"grip {j}.release", known["timeline"]["release"] * run.camera.fps - float(found[-1])


def _along_the_view(run: Run, truth: TruthSeen) -> float:
    """How much longer a way straight through a layer is along z, for the plane that lies nearest the surface [1]."""
    z = truth.depth[0].astype(float)
    rows, columns = np.nonzero(z > 0)
    focal = truth.focal
    x = (columns - columns.mean()) / focal * z[rows, columns]
    y = (rows - rows.mean()) / focal * z[rows, columns]
    slope = np.linalg.lstsq(np.stack([x, y, np.ones(len(x))], -1), z[rows, columns], rcond=None)[0][:2]
    return float(np.sqrt(1 + (slope**2).sum()))
