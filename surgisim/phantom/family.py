"""Clips of many kinds whose truth is known: what a seed decides about each, as settings of the graph.

Nothing is read off the embedded clip: every number is drawn from what laparoscopes, tissues and pulls are said to be.
"""

import math
from typing import Any

import numpy as np

from surgisim.config.phantom import Phantom
from surgisim.phantom.block import mesh
from surgisim.phantom.case import invent
from surgisim.phantom.elements import elements
from surgisim.phantom.ogrid import squeezes_none
from surgisim.problem import Problem

REST, LOAD, HOLD, AFTER = (0.2, 0.5), (0.4, 0.9), (0.5, 1.1), (0.5, 1.0)
"""How long the tissue rests before the pull, is loaded, held, and seen once let go [s]."""
RATES = (15.0, 20.0, 25.0, 30.0, 50.0, 60.0)
"""Frames per second [1/s]."""
FRAMES = 90
"""Most frames of a clip: a faster camera sees a shorter one."""
REST_SHOWN, LOAD_SHOWN, HOLD_SHOWN, AFTER_SHOWN = (0.4, 0.7), (0.5, 0.9), (1.0, 1.6), (0.8, 1.3)
"""The same of a clip that conceals something: every phase long enough to tell laws apart [s]."""
RATES_SHOWN = (15.0, 20.0, 25.0)
"""Its frames per second: all phases are seen [1/s]."""
THICK = (0.012, 0.022)
"""Its tissue's thickness: a grip fits in coarser elements too [m]."""
WIDTH, HEIGHT = 160, 128
"""Of the pictures [px]."""
SPACING = 2.8e-3
"""Edge of the finite elements [m]."""
CLOSED = 0.04
"""The jaws are closed so long before the pull begins [s]."""
FARTHEST = 0.7
"""Longest pull, as a share of the tissue's thickness: one of its own thickness turns elements inside out."""


def family(seed: int, count: int) -> dict[str, dict[str, Any]]:
    """Name -> the keys of config.yaml that this clip changes, nested. The first clips of a seed are always the same."""
    return {f"family-{seed}-{n}": draw(seed, n) for n in range(count)}


def draw(seed: int, n: int) -> dict[str, Any]:
    """One clip: camera, tissue, pull and picture quality, each from a generator of its own."""
    camera, told = _camera(_generator(seed, n, "camera"))
    fps, times = _times(_generator(seed, n, "times"))
    tissue = _tissue(_generator(seed, n, "tissue"))
    phantom = {
        "width": WIDTH,
        "height": HEIGHT,
        "fps": fps,
        **camera,
        **tissue,
        **_pull(_generator(seed, n, "pull"), FARTHEST * tissue["thickness"]),
        **times,
        **_picture(_generator(seed, n, "picture")),
        **_air(_generator(seed, n, "air")),
        "dome": _dome(_generator(seed, n, "dome"), tissue["thickness"]),
    }
    seeds = _generator(seed, n, "phantom")
    while True:
        phantom["seed"] = int(seeds.integers(1, 2**31))
        if _meshed(Phantom(**phantom)):
            break
    return {"phantom": phantom | {"spacing": SPACING}, "ingest": {"focal": phantom["focal"] * WIDTH if told else None}}


def draw_shown(seed: int, n: int, spacings: tuple[float, ...]) -> Phantom:
    """One clip that may conceal something: the family's camera, tissue and picture, all phases seen, its sides free.

    spacings: edges of the elements that must fit its relief and its grip [m].
    """
    camera, _ = _camera(_generator(seed, n, "camera"))
    thickness = float(_generator(seed, n, "thickness").uniform(*THICK))
    phantom = {
        "width": WIDTH,
        "height": HEIGHT,
        **camera,
        **_tissue(_generator(seed, n, "tissue")),
        **_pull(_generator(seed, n, "pull"), FARTHEST * thickness),
        **_times_shown(_generator(seed, n, "times")),
        **_picture(_generator(seed, n, "picture")),
        **_air(_generator(seed, n, "air")),
        "dome": _dome(_generator(seed, n, "dome"), thickness),
        "thickness": thickness,
        "sides": "free",
        "spacing": spacings[0],
    }
    seeds = _generator(seed, n, "phantom")
    while True:
        settings = Phantom(**phantom, seed=int(seeds.integers(1, 2**31)))
        if all(_meshed(settings, spacing, even=True) for spacing in spacings):
            return settings


def told_focal(seed: int, n: int) -> float | None:
    """The focal length [px] that the user of the seed's clip `n` knows; None in one clip of two."""
    camera, told = _camera(_generator(seed, n, "camera"))
    return camera["focal"] * WIDTH if told else None


def _meshed(settings: Phantom, spacing: float = SPACING, *, even: bool = False) -> bool:
    """Whether finite elements fit relief and grip: not every pair can be meshed, and another seed has another.

    even: whether none of them may be so small as to rule the steps.
    """
    case = invent(settings)
    try:
        block = mesh(case.shape, case.grip, spacing, hold_sides=settings.sides == "held")
        elements(block.points, block.cells, case.law)
    except Problem:
        return False
    return not even or squeezes_none(block.points, block.cells, spacing)


def _generator(seed: int, n: int, part: str) -> np.random.Generator:
    return np.random.default_rng([seed, n, *part.encode()])


def _camera(rng: np.random.Generator) -> tuple[dict[str, float], bool]:
    """A view of 45 to 75 mm of tissue from 50 to 100 mm, its focal length told in one of two clips."""
    distance = rng.uniform(0.05, 0.10)
    focal = float(np.clip(distance / rng.uniform(0.045, 0.075), 0.75, 1.7))
    return {"distance": distance, "focal": focal, "slant": rng.uniform(0, 0.6)}, bool(rng.random() < 0.5)


def _times(rng: np.random.Generator) -> tuple[float, dict[str, float]]:
    """Rest, load, hold, release; in one clip of five the grip never lets go."""
    fps = float(rng.choice(RATES))
    rest, load, hold, after = (rng.uniform(*ends) for ends in (REST, LOAD, HOLD, AFTER))
    if rng.random() < 0.2:
        hold, after = hold + after, 0.0
    short = min(1.0, FRAMES / fps / (rest + load + hold + after))
    begin, arrive, release, end = np.cumsum([rest, load, hold, after]) * short
    times = {"grasp": begin - CLOSED, "load": begin, "hold": arrive, "release": release, "duration": end}
    return fps, {name: float(t) for name, t in times.items()}


def _times_shown(rng: np.random.Generator) -> dict[str, float]:
    """Rest, load, hold, release of whole frames."""
    fps = float(rng.choice(RATES_SHOWN))
    spans = [rng.uniform(*ends) for ends in (REST_SHOWN, LOAD_SHOWN, HOLD_SHOWN, AFTER_SHOWN)]
    begin, arrive, release, end = (np.rint(np.cumsum(spans) * fps) / fps).tolist()
    return {
        "fps": fps, "grasp": begin - CLOSED, "load": begin, "hold": arrive, "release": release, "duration": end
    }  # fmt: skip


def _tissue(rng: np.random.Generator) -> dict[str, Any]:
    """E of .3 to 5 kPa, nu of .40 to .48, eta / E of 1 to 8 ms; 10 to 24 mm thick, its sides free or held."""
    while True:
        E, lag = 300 * math.exp(rng.uniform(0, math.log(5000 / 300))), 1e-3 * math.exp(rng.uniform(0, math.log(8)))
        if E * lag < 12.0:
            break
    return {
        "E": E,
        "nu": rng.uniform(0.40, 0.48),
        "eta": E * lag,
        "thickness": rng.uniform(0.010, 0.024),
        "relief": rng.uniform(0.5e-3, 2.5e-3),
        "sides": str(rng.choice(["free", "held"])),
    }


def _pull(rng: np.random.Generator, farthest: float) -> dict[str, float]:
    """5 to 11 mm and at most `farthest` [m], from along the tissue to steeply off it."""
    return {
        "pull": rng.uniform(5e-3, min(11e-3, farthest)),
        "lift": rng.uniform(0.0, 1.2),
        "grip_radius": rng.uniform(4e-3, 6.5e-3),
    }


def _picture(rng: np.random.Generator) -> dict[str, Any]:
    """Sensor noise and compression."""
    return {"noise": rng.uniform(0.003, 0.015), "crf": int(rng.integers(10, 28))}


def _air(rng: np.random.Generator) -> dict[str, float]:
    """From dull to dripping tissue; in one clip of four with smoke before it."""
    return {"wet": rng.uniform(0.3, 2.0), "smoke": rng.uniform(0.05, 0.3) if rng.random() < 0.25 else 0.0}


def _dome(rng: np.random.Generator, thickness: float) -> float:
    """In one clip of three the tissue is a dome, up to a third of its thickness high [m]."""
    return rng.uniform(0.1, 0.35) * thickness if rng.random() < 1 / 3 else 0.0
