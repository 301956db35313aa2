"""A hypothesis of the coarse search on a finer lattice: place, extent, moments, angles, times."""

from collections.abc import Iterator

import numpy as np

from surgisim.diagnosis import local, memory, whole
from surgisim.diagnosis.base import Base
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import APART, Block, plane, scale
from surgisim.diagnosis.hypothesis import Hypothesis

PUSHES = ("hidden_contact", "added_mass", "tether")


def finer(clip: Clip, base: Base, h: Hypothesis, step: float = 1.0) -> Iterator[Block]:
    """Blocks around a hypothesis; `step` is a share of the coarse search's spacing."""
    turns = np.array([-0.5, 0.0, 0.5]) * step * 2 * np.pi / whole.ANGLES
    near = step * np.array([-0.5, 0.0, 0.5])
    if h.term in PUSHES:
        for center in _within(clip, _around(clip, h, step, 0.0), h.place.extent):
            yield local.pushes(clip, base, center, h.place.extent, h)
        for share in (0.7, 1.4):
            yield local.pushes(clip, base, np.array(h.place.center), share * h.place.extent, h)
    elif h.term == "stiff_inclusion":
        centers = np.concatenate([_around(clip, h, step, deep) for deep in (-0.5, 0.0, 0.5)])
        for share in (0.75, 1.0, 1.35):
            yield local.lumps(clip, base, _within(clip, centers, share * h.place.extent), share * h.place.extent)
    elif h.term == "fibre":
        yield whole.strands(clip, base, h.about["turn"] + turns / 2, (0.05, 0.2, 0.5, 1.5))
    elif h.term == "respiration":
        # A rate off by two parts in a hundred is out of step by the time of the frames held out.
        reach = 0.12 if step == 1 else 0.02
        yield whole.breathing(clip, base, h.about["rate"] * np.exp(reach * np.linspace(-1, 1, 13)))
    elif h.term in ("relaxation", "plastic_set", "damage"):
        key = {"relaxation": "tau", "plastic_set": "yield_strain", "damage": "onset"}[h.term]
        values = h.about[key] * np.exp((0.7 if h.term == "relaxation" else 0.4) * near)
        yield memory.remembering(clip, base, [(h.term, {**h.about, key: float(v)}) for v in values])
    elif h.term == "active_contraction":
        b = h.about
        starts = sorted({0.0, b["start"], *(b["start"] + s for s in (0.4, 0.8, 1.3))} if step == 1 else {b["start"]})
        yield from whole.contracting(
            clip, base, b["turn"] + turns, b["wavelength"] * np.exp(0.5 * near), b["period"] * np.exp(0.18 * near),
            b["phase"] + 2 * near / step * np.pi / 6 * step, starts,
        )  # fmt: skip


def _around(clip: Clip, h: Hypothesis, step: float, deep: float) -> np.ndarray:
    """Places beside one, (9, 3)."""
    apart, (u, v) = 0.5 * step * APART * scale(clip), plane(clip)
    middle = np.array(h.place.center) - deep * apart * clip.normal
    return np.array([middle + apart * (a * u + b * v) for a in (-1, 0, 1) for b in (-1, 0, 1)])


def _within(clip: Clip, centers: np.ndarray, extent: float) -> np.ndarray:
    """Those of some places, (Q, 3), that have tissue within an extent, or a cell."""
    free, reach = clip.body.rest[~clip.body.held], max(extent, clip.body.spacing)
    return centers[[np.linalg.norm(free - c, axis=1).min() < reach for c in centers]]
