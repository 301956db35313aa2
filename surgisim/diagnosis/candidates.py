"""What may have been left out: every law with the places, times and forms in which it is tried.

A block is a set of signatures (what the observed points would do); a hypothesis is a law at one place, time and form,
as a combination of a block's columns. Signatures come from the laws' own float64 forms along the base run, answered by
its tangent stiffness (tangent.py); for a law that neither remembers nor looks at the clock they are computed at the
tangent's states.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from surgisim.diagnosis.base import Base
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.tangent import base_piola, piola
from surgisim.mpm.setup import Values
from surgisim.physics.catalogue import choose
from surgisim.physics.place import Place

KNOT = 0.18
"""Time between the knots of a free time course [s]."""
APART = 0.0075
"""Distance between places that are tried [m], for a body of 36 mm; it follows the body's size."""
BLOB = 0.0032
"""Extent of a push or a band that is tried, likewise [m]."""
LUMP = 0.0040
"""Extent of a lump, likewise [m]."""
RISE = 0.12
"""How long a load takes to come or leave [s]."""
TAUS = (0.1, 0.2, 0.4, 0.8, 1.6, 3.2)
YIELDS = (0.05, 0.08, 0.12, 0.17, 0.24)
TEARS = (0.05, 0.08, 0.12, 0.17, 0.24)
ANGLES = 12
PERIODS = (0.8, 1.0, 1.25, 1.6, 2.0)
WAVES = (0.024, 0.045)
SMALL = 1e-3
STEPS = 2
"""Steps between two frames in which a memory advances."""


@dataclass(frozen=True)
class Hypothesis:
    term: str
    mix: np.ndarray
    """From amplitudes to the block's columns, (C, H)."""
    sign: int = 0
    """1 where an amplitude below zero is no tissue's; 0 where both are possible."""
    place: Place | None = None
    onset: float | None = None
    end: float | None = None
    about: dict = field(default_factory=dict)
    """The other numbers of the form."""


@dataclass(frozen=True)
class Block:
    columns: np.ndarray
    """Displacement of the points by one unit of each [m], (C, K, T, 3)."""
    hypotheses: list[Hypothesis]


def knots(clip: Clip) -> np.ndarray:
    """[s], from the first fitted frame to the last."""
    last = (clip.until - 1) / clip.fps
    return np.linspace(0, last, max(4, round(last / KNOT)))


def hats(clip: Clip) -> np.ndarray:
    """Piecewise linear courses, one a knot, (B, T)."""
    at, time = knots(clip), clip.time[: clip.until]
    return np.stack([np.interp(time, at, e) for e in np.eye(len(at))])


def places(clip: Clip, apart: float | None = None, depth: float = 0.15) -> np.ndarray:
    """Centres that are tried [m], (Q, 3): a lattice over the observed side, a share of the depth below it."""
    apart = apart or APART * scale(clip)
    axes = _plane(clip)
    flat = clip.rest @ axes.T
    low, high = flat.min(0), flat.max(0)
    count = np.maximum(1, np.round((high - low) / apart)).astype(int)
    grid = [a + (np.arange(n) + 0.5) * (b - a) / n for a, b, n in zip(low, high, count, strict=True)]
    wanted = np.stack(np.meshgrid(*grid), -1).reshape(-1, 2)
    away = np.linalg.norm(flat[None] - wanted[:, None], axis=-1)
    wanted = wanted[away.min(1) < 1.2 * apart]
    free = clip.body.rest[~clip.body.held].astype(float)
    across, height = free @ axes.T, free @ clip.normal
    found = []
    for spot in wanted:
        near = np.linalg.norm(across - spot, axis=1) < 0.8 * clip.body.spacing
        if near.any():
            top, bottom = height[near].max(), height[near].min()
            found.append(spot @ axes + (top - depth * (top - bottom)) * clip.normal)
    return np.array(found).reshape(-1, 3)


def scale(clip: Clip) -> float:
    """Size of the body over that for which the lengths here were chosen."""
    return float(np.cbrt(clip.recording.mesh.volume)) / 0.036


def _plane(clip: Clip) -> np.ndarray:
    """Two directions along the observed side, (2, 3)."""
    u = np.cross(clip.normal, [0.0, 0.0, 1.0] if abs(clip.normal[2]) < 0.9 else [0.0, 1.0, 0.0])
    u = u / np.linalg.norm(u)
    return np.stack([u, np.cross(clip.normal, u)])


def ease(s: np.ndarray) -> np.ndarray:
    s = np.clip(s, 0, 1)
    return s**3 * (10 - 15 * s + 6 * s * s)


def pushes(clip: Clip, base: Base, center: np.ndarray, extent: float | None = None) -> Block:
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
    found = [*_contacts(clip, place, at), *_masses(clip, place, at), *_bands(clip, base, place, weight, at)]
    return Block(columns, found)


def _spread(course: np.ndarray) -> np.ndarray:
    """A course over knots, (B,), for every direction, (3 B, 3)."""
    return np.kron(np.eye(3), course[:, None])


def _moments(clip: Clip, count: int) -> np.ndarray:
    last = (clip.until - 1) / clip.fps
    return np.linspace(0.0, 0.92 * last, count)


def _contacts(clip, place, at) -> Iterator[Hypothesis]:
    last = at[-1]
    for begin in _moments(clip, 14):
        for length in (0.5, 0.8, 1.2, 2.0):
            end = begin + length
            if end < last + 0.3:
                course = ease((at - begin) / RISE) * ease((end - at) / RISE)
                if course.any():
                    yield Hypothesis("hidden_contact", _spread(course), 0, place, begin, end)


def _masses(clip, place, at) -> Iterator[Hypothesis]:
    gravity = clip.recording.gravity
    down = -clip.normal if gravity is None or not any(gravity) else np.array(gravity) / np.linalg.norm(gravity)
    for begin in _moments(clip, 22):
        course = ease((at - begin) / RISE)
        if course.any():
            yield Hypothesis("added_mass", _spread(course) @ down[:, None], 1, place, begin, None, {"down": down})


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


def bulk(clip: Clip, base: Base) -> Block:
    """Weight that changes: of all tissue at once."""
    near = base.tangent
    weight = np.full(len(base.prepared.simulator.volume_p), clip.density)
    loads = near.of_push(weight[None, :, None] * np.eye(3)[:, None])
    states = near.at_states(np.broadcast_to(loads, (len(near.frames), *loads.shape)))
    bumps, at = hats(clip), knots(clip)
    columns = np.stack([near.over_time(states[:, d], bump) for d in range(3) for bump in bumps])
    begins = _moments(clip, 22)
    found = [Hypothesis("gravity", _spread(ease((at - b) / RISE)), 0, None, b) for b in begins]
    return Block(columns, [h for h in found if h.mix.any()])


def breathing(clip: Clip, base: Base) -> Block:
    """The held base moves."""
    near, at = base.tangent, knots(clip)
    loads = near.anchored(0).T
    states = near.at_states(np.broadcast_to(loads, (len(near.frames), *loads.shape)))
    columns = np.stack([near.over_time(states[:, d], bump) for d in range(3) for bump in hats(clip)])
    found, last = [], at[-1]
    for rate in np.geomspace(max(0.18, 0.7 / last), 0.75, 14):
        up = ease(at / 0.5)
        turn = 2 * np.pi * rate * at
        waves = [up * np.sin(turn), up * (np.cos(turn) - 1), 0.5 * up * np.sin(2 * turn), 0.5 * up * (np.cos(2 * turn) - 1)]
        mix = np.concatenate([_spread(w) for w in waves], 1)
        found.append(Hypothesis("respiration", mix, 0, None, None, None, {"rate": rate}))
    return Block(columns, found)


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
            course = np.where((time > onset) & (length > 0), np.maximum(length - start, 0) / np.maximum(length, 1e-9), 0)
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
    return Block(
        np.stack(columns), [Hypothesis(t, eye[:, k : k + 1], 0, p) for k, (t, p) in enumerate(found)]
    )


def _by_states(base: Base, stress: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    near = base.tangent
    rest = stress(np.broadcast_to(np.eye(3), (len(base.prepared.simulator.rest), 3, 3)).copy())
    loads = np.stack([near.of_stress(stress(near.gradient(f)) - rest) for f in near.frames])
    return near.over_time(near.at_states(loads[:, None])[:, 0])


def everywhere(clip: Clip, base: Base) -> Block:
    """Laws of the whole body without memory: strands, stiffening, pretension."""
    laws, (u, v) = choose(["fibre", "stiffening", "pretension"]), _plane(clip)
    columns, found = [], []
    columns.append(_by_states(base, lambda F: piola(laws["stiffening"], F, {"k": 1.0})))
    found.append(("stiffening", [0], 1, {}))
    for turn in np.arange(ANGLES) * np.pi / ANGLES:
        for k2 in (0.2,):
            a = np.cos(turn) * u + np.sin(turn) * v
            row = {"k1": 1.0, "k2": k2, "x": a[0], "y": a[1], "z": a[2]}
            columns.append(_by_states(base, lambda F, r=row: piola(laws["fibre"], F, r)))
            found.append(("fibre", [len(columns) - 1], 1, {"k2": k2, "axis": a}))
    first = len(columns)
    for turn in (0.0, np.pi / 3, 2 * np.pi / 3):
        a = np.cos(turn) * u + np.sin(turn) * v
        row = {"along": 1.0, "across": 0.0, "x": a[0], "y": a[1], "z": a[2]}
        columns.append(_by_states(base, lambda F, r=row: piola(laws["pretension"], F, r)))
    found.append(("pretension", [first, first + 1, first + 2], 0, {"plane": np.stack([u, v])}))
    eye = np.eye(len(columns))
    return Block(np.stack(columns), [Hypothesis(t, eye[:, k], s, None, None, None, a) for t, k, s, a in found])


def remembering(clip: Clip, base: Base) -> Block:
    """Laws that remember: relaxation, plastic set, damage; followed along every frame."""
    near, laws = base.tangent, choose(["relaxation", "plastic_set", "damage"])
    until, count = clip.until, len(base.prepared.simulator.rest)
    forms = [("relaxation", {"G": 1.0, "tau": t}) for t in TAUS]
    forms += [("plastic_set", {"yield_strain": y, "share": SMALL}) for y in YIELDS]
    forms += [("damage", {"onset": y, "rate": SMALL}) for y in TEARS]
    memory = [np.zeros((count, laws[n].memory)) for n, _ in forms]
    loads = np.zeros((len(forms), until, 3 * len(base.prepared.simulator.place)))
    still = np.zeros((count, 3, 3))
    before, stress = near.gradient(0), None
    for t in range(1, until):
        F = near.gradient(t)
        stays = stress is not None and np.abs(F - before).max() < 1e-5
        stress = stress if stays else base_piola(base.prepared, base.values, F)
        for n, (name, row) in enumerate(forms):
            law = laws[name]
            if stays and name != "relaxation":
                loads[n, t] = loads[n, t - 1]
                continue
            for s in range(1 if stays else STEPS):
                G = F if stays else before + (F - before) * (s + 1) / STEPS
                dt = 1 / clip.fps / (1 if stays else STEPS)
                memory[n] = law.twin_advance(G, still, None, memory[n], dt, **row)
            if name == "relaxation":
                P = piola(law, F, row, memory[n])
            elif name == "damage":
                P = (law.twin(F, memory[n], **row) - 1)[:, None, None] / SMALL * stress
            else:
                flow = law.twin(memory[n], **row)
                # First Piola against F of a stress that sees F G: J sigma(F G) F^-T.
                P = (base_piola(base.prepared, base.values, F @ flow) @ np.swapaxes(flow, -1, -2) - stress) / SMALL
            loads[n, t] = near.of_stress(P)
        before = F
    columns = np.stack([near.history(load) for load in loads])
    eye = np.eye(len(forms))
    return Block(columns, [Hypothesis(n, eye[:, k : k + 1], 1, None, None, None, row) for k, (n, row) in enumerate(forms)])


def contracting(clip: Clip, base: Base, angles: int = 6) -> Iterator[Block]:
    """Waves of contraction along a direction of the tissue's plane."""
    near, rest, (u, v) = base.tangent, base.prepared.simulator.rest, _plane(clip)
    time = clip.time[: clip.until]
    for turn in np.arange(2 * angles) * np.pi / angles:
        a = np.cos(turn) * u + np.sin(turn) * v
        axes = [near.gradient(f) @ a for f in near.frames]
        pull = [Fa[:, :, None] * a[None, None, :] for Fa in axes]
        columns, found = [], []
        for wave in WAVES:
            k = 2 * np.pi / (wave * scale(clip))
            phase = k * ((rest - rest.mean(0)) @ a)
            patterns = [np.ones(len(rest)), np.cos(phase), np.sin(phase), np.cos(2 * phase), np.sin(2 * phase)]
            loads = np.stack([near.of_stress(np.stack([p[:, None, None] * P for p in patterns])) for P in pull])
            states = near.at_states(loads)
            for period in PERIODS:
                for shift in np.arange(6) * 2 * np.pi / 6:
                    turns = 2 * np.pi * time / period + shift
                    courses = _wave(turns)
                    up = ease(time / 0.3)
                    signature = sum(near.over_time(states[:, m], up * courses[m]) for m in range(5))
                    columns.append(signature)
                    about = {"period": period, "wavelength": wave * scale(clip), "axis": a, "phase": shift}
                    found.append(about)
        eye = np.eye(len(columns))
        yield Block(
            np.stack(columns), [Hypothesis("active_contraction", eye[:, n : n + 1], 1, None, 0.0, None, b) for n, b in enumerate(found)]
        )


def _wave(turns: np.ndarray) -> list[np.ndarray]:
    """max(0, sin(turns - phase))^2 up to its second harmonic, by 1, cos, sin, cos 2, sin 2 of the phase."""
    one, two = 4 / (3 * np.pi), -0.25
    return [
        np.full_like(turns, 0.25), one * np.sin(turns), -one * np.cos(turns), two * np.cos(2 * turns), two * np.sin(2 * turns),
    ]  # fmt: skip


def blocks(clip: Clip, base: Base) -> Iterator[tuple[str, Callable[[], Iterator[Block]]]]:
    """All that is tried, one part after the other, each made when it is asked for."""
    yield "laws of the whole body", lambda: iter([everywhere(clip, base)])
    yield "laws that remember", lambda: iter([remembering(clip, base)])
    yield "weight", lambda: iter([bulk(clip, base)])
    if clip.body.held.any():
        yield "breathing", lambda: iter([breathing(clip, base)])
    if len(clip.motion.radius):
        yield "slipping grips", lambda: slipping(clip, base)
    for depth in (0.15, 0.45):
        yield "lumps", lambda d=depth: iter([lumps(clip, base, places(clip, depth=d))])
    for center in places(clip):
        yield "pushes and bands", lambda c=center: iter([pushes(clip, base, c)])
    yield "contractions", lambda: contracting(clip, base)
