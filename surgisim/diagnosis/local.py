"""What may be missing in one place: a push, a weight, a band, a lump, a grip that slips."""

from collections.abc import Iterator

import numpy as np

from surgisim.diagnosis.base import Base
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import Block, hats, knots, moments, scale, spread
from surgisim.diagnosis.hypothesis import RISE, Hypothesis, ease
from surgisim.diagnosis.tangent import base_piola
from surgisim.physics.catalogue import choose
from surgisim.physics.place import Place

BLOB = 0.0032
"""Extent of a push or a band that is tried, likewise [m]."""
LASTS = (0.5, 0.8, 1.2, 2.0)
"""How long an unseen push is tried [s]."""
SHIFTS = (-0.1, -0.05, 0.0, 0.05, 0.1)
"""By which moments are moved when a hypothesis is sharpened [s]."""
LUMP = 0.0040
"""Extent of a lump, likewise [m]."""


def pushes(
    clip: Clip, base: Base, center: np.ndarray, extent: float | None = None, near_to: Hypothesis | None = None
) -> Block:
    """A push at one place with a free course: unseen contact, added mass, a band."""
    near, simulator = base.tangent, base.prepared.simulator
    extent = extent or BLOB * scale(clip)
    place = Place(tuple(center), extent)
    weight = place.weight(simulator.rest) * ~clip.body.held
    weight = weight / (weight * simulator.volume_p).sum()
    loads = near.of_push(weight[None, :, None] * np.eye(3)[:, None])
    states = near.at_states(np.broadcast_to(loads, (len(near.frames), *loads.shape)))
    bumps, at = hats(clip), knots(clip)
    columns = np.stack([near.over_time(states[:, d], bump) for d in range(3) for bump in bumps])
    begins, lengths = moments(clip, 22), LASTS
    if near_to is not None and near_to.onset is not None:
        begins = near_to.onset + np.array(SHIFTS)
        lengths = near_to.end - near_to.onset + np.array(SHIFTS) if near_to.end is not None else LASTS
    found = [
        *_contacts(place, at, begins[:: 1 if near_to else 2], lengths),
        *_masses(clip, place, at, begins),
        *_bands(clip, base, place, weight, at),
    ]
    return Block(columns, found)


def _contacts(place, at, begins, lengths) -> Iterator[Hypothesis]:
    last = at[-1]
    for begin in begins:
        for length in lengths:
            end = begin + length
            if end < last + 0.3:
                course = ease((at - begin) / RISE) * ease((end - at) / RISE)
                if course.any():
                    yield Hypothesis("hidden_contact", spread(course), 0, place, begin, end)


def _masses(clip, place, at, begins) -> Iterator[Hypothesis]:
    gravity = clip.recording.gravity
    down = -clip.normal if gravity is None or not any(gravity) else np.array(gravity) / np.linalg.norm(gravity)
    for begin in begins:
        course = ease((at - begin) / RISE)
        if course.any():
            yield Hypothesis("added_mass", spread(course) @ down[:, None], 1, place, begin, None, {"down": down})


def _bands(clip, base, place, weight, at) -> Iterator[Hypothesis]:
    frames = np.clip(np.round(at * clip.fps).astype(int), 0, clip.until - 1)
    near, term = base.tangent, choose(["tether"])["tether"]
    mine = weight > 1e-3 * weight.max()
    share = weight[mine] * base.prepared.simulator.volume_p[mine]
    moved = np.stack([near.displacement(f)[mine] for f in frames])
    down = -clip.normal
    for slack in (0.0, 3e-4, 6e-4, 1.0e-3, 2e-3):
        for length in (1.5e-3, 4e-3):
            force = term.twin(
                moved, None, None, np.ones(mine.sum()), 0.0, stiffness=1.0, slack=slack * scale(clip),
                length=length * scale(clip), x=down[0], y=down[1], z=down[2],
            )  # fmt: skip
            total = np.einsum("tpd,p->td", force, share)
            if np.abs(total).max() > 1e-5:
                about = {"slack": slack * scale(clip), "length": length * scale(clip), "down": down}
                yield Hypothesis("tether", total.T.reshape(-1, 1), 1, place, None, None, about)


def slipping(clip: Clip, base: Base) -> Iterator[Block]:
    """The grip gives way along its path."""
    near, motion, until = base.tangent, clip.motion, clip.until
    for j in range(len(motion.radius)):
        active = motion.active[j, :until]
        if not active.any():
            continue
        loads = near.anchored(1 + j).T
        states = near.at_states(np.broadcast_to(loads, (len(near.frames), *loads.shape)))
        path = np.where(active[:, None], motion.position[j, :until] - motion.center_rest[j], 0.0)
        way = [near.over_time(states[:, d], np.ones(until)) * path[None, :, d, None] for d in range(3)]
        full = -sum(way)
        time, length = clip.time[:until], np.linalg.norm(path, axis=1)
        # A share lost from the start is how firmly the grid carries a grip (nuisance.grips), not a slip.
        begin, last = time[np.argmax(length > 0.3 * length.max())], time[active][-1]
        columns, found = [], []
        for onset in np.linspace(begin, last - 0.15, 12):
            for tau in (0.05, 0.15, 0.35, 0.7):
                late = np.maximum(time - onset, 0) / tau
                columns.append(full * ((1 - np.exp(-late)) ** 2)[None, :, None])
                found.append((onset, {"tau": tau, "grip": j}))
            start = np.interp(onset, time, length)
            course = np.where(
                (time > onset) & (length > 0), np.maximum(length - start, 0) / np.maximum(length, 1e-9), 0
            )
            if course.max() > 0.05:
                columns.append(full * course[None, :, None])
                found.append((onset, {"tau": 0.0, "grip": j}))
        place = Place(tuple(motion.center_rest[j]), float(motion.radius[j]))
        eye = np.eye(len(columns))
        yield Block(
            np.stack(columns),
            [Hypothesis("tool_slip", eye[:, k : k + 1], 1, place, t, last, a) for k, (t, a) in enumerate(found)],
        )


def lumps(clip: Clip, base: Base, centers: np.ndarray, extent: float | None = None) -> Block:
    """Stiffer or softer tissue in one place, or below a plane."""
    near, rest = base.tangent, base.prepared.simulator.rest
    extent = extent or LUMP * scale(clip)
    stress = [base_piola(base.prepared, base.values, near.gradient(f)) for f in near.frames]
    wheres = [("stiff_inclusion", Place(tuple(c), extent)) for c in centers]
    if clip.body.held.any():
        height = rest @ clip.normal
        bottom = float(height[clip.body.held].max())
        thick = float(np.percentile(height, 98)) - bottom
        for share in (0.25, 0.35, 0.45, 0.55):
            center = rest.mean(0) + (bottom + share * thick - rest.mean(0) @ clip.normal) * clip.normal
            wheres.append(("base_layer", Place(tuple(center), 0.05 * thick, tuple(-clip.normal))))
    columns, found = [], []
    for term, place in wheres:
        weight = place.weight(rest)[:, None, None]
        loads = np.stack([near.of_stress(weight * P) for P in stress])
        columns.append(near.over_time(near.at_states(loads[:, None])[:, 0]))
        found.append((term, place))
    eye = np.eye(len(columns))
    return Block(np.stack(columns), [Hypothesis(t, eye[:, k : k + 1], 0, p) for k, (t, p) in enumerate(found)])
