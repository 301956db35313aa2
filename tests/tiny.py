"""A block of 3 x 3 x 3 cells under any law of the catalogue, small enough for a thousand steps in a blink."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from slab import pulled, slab

from surgisim.mpm.grip import Drive
from surgisim.mpm.setup import Prepared, Values, prepare
from surgisim.physics.catalogue import catalogue, defaults
from surgisim.physics.place import Place

TERMS = catalogue()
CLEAR = {"sliding_base": {"stiffness": 300.0, "cap": 0.03}}
"""Friction at which the block slips or sticks, and rounding does not decide which."""
BASE = {"corotated": {"E": 6000.0, "nu": 0.4}, "newtonian": {"eta": 6.0}}
DENSITY, STEP, FRAMES, PER_FRAME = 1050.0, 4e-4, 11, 100
MIDDLE = Place((0.002, 0.001, 0.068), 0.006)
PULL = pulled(frames=FRAMES, by=(0.0015, 0.0005, -0.002), hold=8, radius=0.006)
TURN = np.array([[np.cos(2.0), -np.sin(2.0), 0.0], [np.sin(2.0), np.cos(2.0), 0.0], [0.0, 0.0, 1.0]])
BODY = slab(size=(0.018, 0.018, 0.018), spacing=0.006, per_axis=2)


@cache
def body(names: tuple[str, ...], precision: str = "double", sharp: bool = False) -> Prepared:
    """The block under these laws, `sharp` if it may bend at the grip's skin; kernels are compiled only once."""
    places = {n: MIDDLE for n in names if TERMS[n].place == "somewhere"}
    return prepare(BODY, names, density=DENSITY, places=places, precision=precision, grips=PULL if sharp else None)


def under(name: str) -> tuple[str, ...]:
    """The base laws and one more."""
    return tuple(dict.fromkeys((*BASE, name)))


def beside(name: str) -> tuple[str, ...]:
    """The base laws, this one and a few others: laws in packs of seven."""
    more = [n for n in TERMS if n not in BASE]
    first = more.index(name) // 7 * 7 if name in more else 0
    return (*BASE, *more[first : first + 7])


def on(names) -> Values:
    return {n: {**defaults(TERMS[n]), **TERMS[n].example, **CLEAR.get(n, {}), **BASE.get(n, {})} for n in names}


def off(name: str) -> dict[str, float]:
    return {p: about.default if about.off is None else about.off for p, about in TERMS[name].params.items()}


def driven(made: Prepared, values: Values, motion=PULL, per_frame: int = PER_FRAME) -> Drive:
    return made.drive(motion, values, fps=1 / STEP / per_frame, per_frame=per_frame)


@dataclass(frozen=True)
class Start:
    """A run about to begin in some state, its anchors where that state has them."""

    drive: Drive
    begin: tuple[np.ndarray, ...]
    first: int
    last: int


def start(made: Prepared, values: Values, state: str, steps: int) -> Start:
    """From 'rest', from 'equal stretch' or 'turned' far, over 1 or 1,000 steps."""
    drive = driven(made, values)
    F = {"rest": np.eye(3), "equal stretch": 1.1 * np.eye(3), "turned": TURN}[state]
    nodes = made.simulator.grid.positions()[made.simulator.place]
    middle = BODY.rest.mean(0)
    u = np.where((made.simulator.place < 0)[:, None], 0, (nodes - middle) @ (F - np.eye(3)).T)
    path = drive.path + ((drive.center - middle) @ (F - np.eye(3)).T)[:, None]
    turn = np.broadcast_to(F if state == "turned" else np.eye(3), (*path.shape[:2], 3, 3))
    drive = replace(drive, path=path, turn=np.array(turn))
    if steps == 1:
        return Start(replace(drive, per_frame=1), (u, 0 * u), 600, 601)
    return Start(drive, (u, 0 * u), 0, FRAMES - 1)
