"""What a recording leaves open, as it came out: camera, timing, grips; and how well every frame is met."""

from typing import Any

import numpy as np
from scipy.linalg import cho_solve

from surgisim.diagnosis.base import TOLD
from surgisim.diagnosis.context import Case
from surgisim.diagnosis.model import base_numbers
from surgisim.diagnosis.nuisance import span

LARGE = 3.0
"""Times the tracking noise's RMS beyond which a camera's drift is worth a sentence."""


def nuisances(case: Case) -> list[dict[str, Any]]:
    """Every nuisance that a reader would ask for: its most likely value beside the base, and how surely."""
    likely = case.space.likely(case.z)
    spread = np.sqrt(np.diag(cho_solve(case.space.factor, np.eye(case.space.columns.shape[1]))))
    result, at, shares = [], 0, {}
    for group in case.groups:
        for n, (name, sd, unit) in enumerate(group.values):
            share = float(spread[at + n])
            result.append(
                {"name": name, "value": float(likely[at + n] * sd), "sd": share * sd, "unit": unit,
                 "said": share < TOLD}
            )  # fmt: skip
        shares[group.name] = float(np.sqrt((spread[at : at + len(group.columns)] ** 2).mean()))
        at += len(group.columns)
    drift = drifted(case)
    if drift is not None:
        sd = shares["drift"] * float(np.linalg.norm(case.drift))
        result.append(
            {"name": "camera drift by the end", "value": drift, "sd": sd, "unit": "m",
             "said": shares["drift"] < TOLD}
        )  # fmt: skip
    fitted = {entry["name"]: entry for entry in result}
    for j, last in case.clip.releases():
        # What is left of it beside the moment that the base was fitted with.
        rest = fitted.get(f"release of grip {j} after frame {last}")
        if rest is not None:
            late = float(case.clip.opening[j, last]) + case.clip.fps * rest["value"]
            name = f"opening of grip {j} after its last active frame"
            result.append(rest | {"name": name, "value": late, "sd": case.clip.fps * rest["sd"], "unit": "frames"})
    held = fitted.get("where what is held ends")
    if case.clip.raised and held is not None:
        name = "where what is held ends, laid anew, beyond its box"
        result.append(held | {"name": name, "value": case.clip.raised + held["value"]})
    return result


def drifted(case: Case, after: np.ndarray | None = None) -> float | None:
    """How far the camera has drifted by the last fitted frame, RMS over the points [m]; None where it is left out.

    after: displacement of the points beside which it drifts [m], (K, T, 3); the base's if None.
    """
    mine, until = span(case.groups, "drift"), case.clip.until
    if mine.start == mine.stop:
        return None
    z = case.z if after is None else case.whiten(case.clip.moved[:, :until] - after[:, :until])
    columns = next(g.columns for g in case.groups if g.name == "drift")
    end = np.einsum("c,cki->ki", case.space.likely(z)[mine], columns[:, :, until - 1])
    return float(np.sqrt((end**2).sum(1).mean()))


def told(case: Case, after: np.ndarray | None = None) -> list[str]:
    """Sentences on what is no tissue's physics and large all the same; after: as in `drifted`."""
    said, drift = [], drifted(case, after)
    if drift is not None and drift > LARGE * case.noise.plain:
        said.append(f"Not tissue: the camera drifts by {1e3 * drift:.2g} mm.")
    for j, last in case.clip.releases():
        late = float(case.clip.opening[j, last])
        if not -0.3 < late < 1.3:
            way = "later" if late > 0 else "earlier"
            said.append(f"Grip {j} opens {abs(late):.1f} frames {way} than its last active frame says.")
    if abs(case.clip.raised) > 1e-3:
        way = "beyond" if case.clip.raised > 0 else "short of"
        said.append(f"What is held seems to end {1e3 * abs(case.clip.raised):.1f} mm {way} its box.")
    for name in case.base.bound:
        said.append(f"{name} came to the end of what is tried: the recording does not tell it.")
    if case.base.pulls is not None:
        forces = case.base.pulls.told(case.base.x)
        said.append(
            f"Its moduli follow {forces['count']} measured components of force: the largest is "
            f"{forces['largest']:.3g} N, simulated {forces['simulated_there']:.3g} N."
        )
    if "E" in case.base.untold and "E" not in case.base.bound:
        E = base_numbers(case.base)["E"]
        said.append(
            f"E is hardly told: from {1e-3 * E['low']:.2g} to {1e-3 * E['high']:.2g} kPa all fit about as well."
        )
    return said


def goodness(case: Case, after: np.ndarray) -> dict[str, Any]:
    """Chi square per degree of freedom of every fitted frame, nuisances at their most likely values.

    after: displacement of the points with what is named [m], (K, T, 3).
    """
    clip = case.clip
    z = case.whiten(clip.moved[:, : clip.until] - after[:, : clip.until])
    left = (z - case.space.explained(z)).reshape(len(clip.kept), clip.until, 3)
    seen = 3.0 * clip.seen[:, : clip.until].sum(0)
    # Constants and nuisances take their share of every frame alike.
    degrees = np.maximum(seen * case.whiten.free / max(seen.sum(), 1), 1)
    per_frame = (left**2).sum((0, 2)) / degrees
    return {"per_frame": [float(g) for g in per_frame], "degrees": [float(d) for d in degrees]}
