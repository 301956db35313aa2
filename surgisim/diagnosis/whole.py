"""What may be missing everywhere: a change of weight, breathing, strands, stiffening, pretension, contractions."""

import itertools
from collections.abc import Callable, Iterator

import numpy as np

from surgisim.diagnosis.base import Base
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import Block, hats, knots, moments, plane, scale, spread
from surgisim.diagnosis.hypothesis import RISE, SETS_IN, Hypothesis, ease
from surgisim.diagnosis.tangent import piola
from surgisim.physics.catalogue import choose

ANGLES = 12
GROWS = (-1.0, 1.0)
"""How the tension of a pretension goes with stretch."""
AXES = ("ax", "ay", "az", "bx", "by", "bz")
PERIODS = (0.8, 1.0, 1.25, 1.6, 2.0)
WAVES = (0.024, 0.045)
PHASES = tuple(np.arange(6) * 2 * np.pi / 6)


def bulk(clip: Clip, base: Base) -> Block:
    """Weight that changes: of all tissue at once."""
    near = base.tangent
    weight = np.full(len(base.prepared.simulator.volume_p), clip.density)
    loads = near.of_push(weight[None, :, None] * np.eye(3)[:, None])
    states = near.at_states(np.broadcast_to(loads, (len(near.frames), *loads.shape)))
    bumps, at = hats(clip), knots(clip)
    columns = np.stack([near.over_time(states[:, d], bump) for d in range(3) for bump in bumps])
    begins = moments(clip, 22)
    found = [Hypothesis("gravity", spread(ease((at - b) / RISE)), 0, None, b) for b in begins]
    return Block(columns, [h for h in found if h.mix.any()])


def breathing(clip: Clip, base: Base, rates: np.ndarray | None = None) -> Block:
    """The held base moves."""
    near, at = base.tangent, knots(clip)
    loads = near.anchored(0).T
    states = near.at_states(np.broadcast_to(loads, (len(near.frames), *loads.shape)))
    columns = np.stack([near.over_time(states[:, d], bump) for d in range(3) for bump in hats(clip)])
    found, last = [], at[-1]
    rates = np.geomspace(max(0.18, 0.7 / last), 0.75, 14) if rates is None else rates
    for rate in rates:
        up = ease(at / 0.5)
        turn = 2 * np.pi * rate * at
        waves = [
            up * np.sin(turn),
            up * (np.cos(turn) - 1),
            0.5 * up * np.sin(2 * turn),
            0.5 * up * (np.cos(2 * turn) - 1),
        ]
        mix = np.concatenate([spread(w) for w in waves], 1)
        found.append(Hypothesis("respiration", mix, 0, None, None, None, {"rate": rate}))
    return Block(columns, found)


def _by_states(base: Base, stress: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    near = base.tangent
    rest = stress(np.broadcast_to(np.eye(3), (len(base.prepared.simulator.rest), 3, 3)).copy())
    loads = np.stack([near.of_stress(stress(near.gradient(f)) - rest) for f in near.frames])
    return near.over_time(near.at_states(loads[:, None])[:, 0])


def strands(clip: Clip, base: Base, turns: np.ndarray, grows: tuple[float, ...]) -> Block:
    """Fibres along directions of the tissue's plane [rad], for exponents k2."""
    law, (u, v) = choose(["fibre"])["fibre"], plane(clip)
    columns, found = [], []
    for turn in turns:
        for k2 in grows:
            a = np.cos(turn) * u + np.sin(turn) * v
            row = {"k1": 1.0, "k2": k2, "x": a[0], "y": a[1], "z": a[2]}
            columns.append(_by_states(base, lambda F, r=row: piola(law, F, r)))
            found.append({"k2": k2, "axis": a, "turn": turn})
    eye = np.eye(len(columns))
    return Block(
        np.stack(columns),
        [Hypothesis("fibre", eye[:, n : n + 1], 1, None, None, None, about) for n, about in enumerate(found)],
    )


def everywhere(clip: Clip, base: Base) -> Block:
    """Laws of the whole body without memory or direction of their own: stiffening, pretension."""
    laws, (u, v) = choose(["stiffening", "pretension"]), plane(clip)
    columns, found = [], []
    columns.append(_by_states(base, lambda F: piola(laws["stiffening"], F, {"k": 1.0})))
    found.append(("stiffening", [0], 1, {}))
    for grows in GROWS:
        first = len(columns)
        for turn in (0.0, np.pi / 3, 2 * np.pi / 3):
            a = np.cos(turn) * u + np.sin(turn) * v
            row = {
                "along": 1.0,
                "across": 0.0,
                "grows": grows,
                **dict(zip(AXES, (*a, *np.cross(a, clip.normal)), strict=True)),
            }
            columns.append(_by_states(base, lambda F, r=row: piola(laws["pretension"], F, r)))
        about = {"plane": np.stack([u, v]), "grows": grows}
        found.append(("pretension", [first, first + 1, first + 2], 0, about))
    eye = np.eye(len(columns))
    return Block(np.stack(columns), [Hypothesis(t, eye[:, k], s, None, None, None, a) for t, k, s, a in found])


def contracting(
    clip: Clip, base: Base, turns: np.ndarray | None = None, waves=WAVES, periods=PERIODS, shifts=PHASES, starts=(0.0,)
) -> Iterator[Block]:
    """Waves of contraction along directions of the tissue's plane [rad], a block each.

    waves: lengths [m]; periods [s]; shifts: phases [rad]; starts: when they set in [s].
    """
    near, rest, (u, v) = base.tangent, base.prepared.simulator.rest, plane(clip)
    time = clip.time[: clip.until]
    turns = np.arange(ANGLES) * 2 * np.pi / ANGLES if turns is None else turns
    for turn in turns:
        a = np.cos(turn) * u + np.sin(turn) * v
        axes = [near.gradient(f) @ a for f in near.frames]
        pull = [Fa[:, :, None] * a[None, None, :] for Fa in axes]
        columns, found = [], []
        for wave in np.array(waves) * (scale(clip) if waves is WAVES else 1.0):
            k = 2 * np.pi / wave
            phase = k * ((rest - rest.mean(0)) @ a)
            patterns = [np.ones(len(rest)), np.cos(phase), np.sin(phase), np.cos(2 * phase), np.sin(2 * phase)]
            loads = np.stack([near.of_stress(np.stack([p[:, None, None] * P for p in patterns])) for P in pull])
            states = near.at_states(loads)
            for period, shift, start in itertools.product(periods, shifts, starts):
                courses = _wave(2 * np.pi * time / period + shift)
                up = ease((time - start) / SETS_IN)
                columns.append(sum(near.over_time(states[:, m], up * courses[m]) for m in range(5)))
                found.append(
                    {"period": period, "wavelength": wave, "axis": a, "phase": shift, "turn": turn, "start": start}
                )
        eye = np.eye(len(columns))
        yield Block(
            np.stack(columns),
            [
                Hypothesis("active_contraction", eye[:, n : n + 1], 1, None, b["start"], None, b)
                for n, b in enumerate(found)
            ],
        )


def _wave(turns: np.ndarray) -> list[np.ndarray]:
    """max(0, sin(turns - phase))^2 up to its second harmonic, by 1, cos, sin, cos 2, sin 2 of the phase."""
    one, two = 4 / (3 * np.pi), -0.25
    return [
        np.full_like(turns, 0.25), one * np.sin(turns), -one * np.cos(turns),
        two * np.cos(2 * turns), two * np.sin(2 * turns),
    ]  # fmt: skip
