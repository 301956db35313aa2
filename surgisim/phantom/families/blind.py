"""Invent a recording of a family that hides something, or nothing, and write down what."""

import hashlib
import json
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from surgisim.config.invent import Invent
from surgisim.phantom import folder
from surgisim.phantom.blind import Invented
from surgisim.phantom.families import hidden as hiding
from surgisim.phantom.families import seen as seeing_of
from surgisim.phantom.families import world as world_of
from surgisim.phantom.families.hidden import KINDS, Hidden
from surgisim.phantom.families.oracle import Oracle
from surgisim.phantom.families.solvers import Solver, solver
from surgisim.phantom.families.world import HANDLING, World
from surgisim.problem import Problem

Progress = Callable[[float, float, str], None]
DECK = ("nothing",) * 6 + ("outside",) * 4 + ("one",) * 10
"""Twenty cases in a row hold these, shuffled."""
STRONG = (25.0, 800.0)
"""Log evidence that an oracle shall have of what is hidden; between them its logarithm is uniform."""
OTHER_GRIPS = ({"wider": 1.1}, {"later": 0.3}, {"sooner": 0.3})
"""As which an effect may not count: grips that are wider, open later or close sooner (`World.gripped`)."""
TRIES = 7
"""Runs of the search for a magnitude."""
PLACES = 4
"""Draws of an effect's place and numbers before a case is given up."""


def invent(settings: Invent, progress: Progress | None = None) -> Invented:
    """Case `settings.case` of `settings.seed` by the solver `settings.family`: the same bytes on one machine.

    Raises Problem where nothing is found that the body bears and an oracle sees.
    """
    engine = solver(settings.family)
    say = progress or (lambda *_: None)

    def generator(part: str) -> np.random.Generator:
        return np.random.default_rng([settings.seed, settings.case, *settings.family.encode(), 0, *part.encode()])

    say(0, 4, "moving the body without what is hidden")
    world, plain = _borne(world_of.draw(generator, engine.MOST_E), engine)
    seeing = seeing_of.draw(generator("seeing"))
    free = seeing_of.visible(world, plain, seeing, generator("visible"))
    name = concealed(settings, engine)
    say(1, 4, "moving it with another base")
    if name is None:
        true, found, surely = plain, None, 0.0
    else:
        true, found, surely = _hide(name, world, plain, engine, free, seeing, generator("hidden"), say)
    say(3, 4, "seen by a camera")
    points = seeing_of.observed(world, true, seeing, generator("noise"))
    called = _name(settings)
    tracks = folder.npz(plain=plain.astype(np.float32), true=true.astype(np.float32))
    truth = _told(settings, world, called, found, surely, (plain, true), free, seeing, tracks)
    say(4, 4, "written")
    whole = (json.dumps(truth, indent=1, allow_nan=False) + "\n").encode()
    return Invented(called, recording(world, called, points, free, seeing), whole, tracks)


def _name(settings: Invent) -> str:
    """Tells nothing of the case."""
    return "r-" + hashlib.sha256(f"{settings.family}/{settings.seed}/{settings.case}".encode()).hexdigest()[:8]


def concealed(settings: Invent, engine: Solver) -> str | None:
    """What a case hides."""
    block, place = divmod(settings.case, len(DECK))

    def rng(what: str) -> np.random.Generator:
        return np.random.default_rng([settings.seed, block, *settings.family.encode(), 1, *what.encode()])

    order = rng("order").permutation(len(DECK))
    kind = DECK[order[place]]
    if kind == "nothing":
        return None
    names = [n for n in engine.CONCEALS if KINDS[n].outside == (kind == "outside")]
    names = [n for n in names if not settings.only or n in settings.only]
    if not names:
        return None
    # Each has its turn before one comes again.
    before = block * DECK.count(kind) + sum(DECK[order[p]] == kind for p in range(place))
    pack, card = divmod(before, len(names))
    return names[np.random.default_rng([settings.seed, pack, 2, *kind.encode()]).permutation(len(names))[card]]


def _borne(world: World, engine: Solver) -> tuple[World, np.ndarray]:
    """The world, its pulls shortened until the body bears them, and its plain paths [m]."""
    for _ in range(6):
        try:
            return world, engine.paths(world, ())
        except Problem:
            world = world.pulled(0.75)
    return world, engine.paths(world, ())


def _hide(name, world, plain, engine, free, seeing, rng, say) -> tuple[np.ndarray, Hidden, float]:
    """Paths with it [m], what it is, and the log evidence that an oracle has of it."""
    base, fitted = left_open(world, plain, engine), np.arange(world.frames) < world.split
    # A camera goes its way over all frames, so that the noise of those that may be fitted is a part of all frames'.
    oracle = Oracle(world.rest, free & fitted, seeing, base)
    asked = math.exp(rng.uniform(*np.log(STRONG)))
    kind = KINDS[name]
    best: tuple[float, np.ndarray, Hidden, float] | None = None
    for _ in range(PLACES):
        hidden = kind.draw(world, rng, name)
        low, high, magnitude = None, None, kind.start
        for n in range(TRIES):
            say(1 + n / TRIES, 4, f"moving the body with {magnitude:.3g} of what is hidden")
            try:
                true = engine.paths(world, (hidden.scaled(magnitude),))
            except Problem:
                high = (math.log(magnitude), math.log(30 * asked))
            else:
                surely = oracle.evidence(true - plain)
                off = abs(math.log(max(surely, 1e-9) / asked))
                if surely >= STRONG[0] and (best is None or off < best[0]):
                    best = off, true, hidden.scaled(magnitude), surely
                if off < 0.25 or (magnitude == kind.most and surely < asked):
                    break
                at = (math.log(magnitude), math.log(max(surely, 1e-9)))
                low, high = (at, high) if surely < asked else (low, at)
            magnitude = min(math.exp(_next(low, high, math.log(asked))), kind.most)
        if best is not None:
            return best[1:]
    raise Problem(
        f"phantom: {name}: no oracle would see it in this body at a magnitude that tissue bears. Take another case."
    )


def left_open(world: World, plain: np.ndarray, engine: Solver) -> list[np.ndarray]:
    """Changes of the plain paths [m], (K, T, 3) each, as which what is hidden may not count: another modulus, Poisson's
    ratio and viscosity, other grips and other ways in which they take tissue along, none of which a recording tells, a
    lag of the tracker and another scale."""
    law = world.material
    stiffer = replace(law, E=1.25 * law.E, eta=1.25 * law.eta)
    others = [world.of_material(m) for m in (stiffer, replace(law, nu=law.nu - 0.04), replace(law, eta=1.25 * law.eta))]
    others += [world.gripped(**how) for how in OTHER_GRIPS]
    handled = {grip.handling for grip in world.grips}
    others += [world.gripped(handling=way) for way in HANDLING if handled != {way}]
    moved = [engine.paths(other, ()) - plain for other in others]
    return [*moved, np.gradient(plain, axis=1), plain - plain[:, :1]]


def _next(low, high, goal: float) -> float:
    """Logarithm of the next magnitude; evidence grows about with its square."""
    if low and high:
        share = (goal - low[1]) / max(high[1] - low[1], 1e-9)
        return low[0] + min(max(share, 0.2), 0.8) * (high[0] - low[0])
    at, level = low or high
    return at + min(max(0.5 * (goal - level), -1.5), 1.5)


def recording(world: World, name: str, points: np.ndarray, free: np.ndarray, seeing: seeing_of.Seeing) -> dict:
    """File name -> bytes, in the public format; nothing in them is longer or shorter for what is hidden."""
    clock, body = np.arange(world.frames), world.body
    told = {
        "format": "surgisim-recording/1",
        "name": name,
        "fps": world.fps,
        "frames": world.frames,
        "length_unit": "m",
        "density_kg_m3": round(world.material.density, 1),
        "gravity_m_s2": None if world.gravity is None else world.gravity.tolist(),
        "tier": "tracks",
        "starts": "settled",
    }
    position = np.stack([g.center + g.path(clock) for g in world.grips])
    active = np.stack([(clock >= g.begin) & (clock <= g.release) for g in world.grips])
    return {
        "recording.json": (json.dumps(told, indent=1) + "\n").encode(),
        "rest.ply": folder.ply(body.points, body.skin),
        "fixed.json": (json.dumps({"boxes": body.boxes}, indent=1) + "\n").encode(),
        "grip.npz": folder.npz(
            center_rest=np.stack([g.center for g in world.grips]), radius=np.array([g.radius for g in world.grips]),
            position=position, active=active,
        ),
        "tracks.npz": folder.npz(
            points=np.where(free[..., None], points, np.nan).astype(np.float32), visible=free,
            sigma=np.full(len(points), seeing.told),
        ),
        "split.json": (
            json.dumps({"fit": [0, world.split], "held_out": [world.split, world.frames]}, indent=1) + "\n"
        ).encode(),
    }  # fmt: skip


def _told(settings, world, name, found, surely, paths, free, seeing, tracks) -> dict:
    """What truth.json says."""
    law, change = world.material, paths[1] - paths[0]

    def ratio(span: slice) -> float:
        some = free[:, span]
        return float(np.sqrt((change[:, span][some] ** 2).sum(-1).mean())) / seeing.sigma if some.any() else 0.0

    kind = "nothing" if found is None else "outside" if KINDS[found.name].outside else "one"
    fitted, held = slice(0, world.split), slice(world.split, None)
    effects = (
        []
        if found is None
        else [
            hiding.described(world, found, found.name in solver(settings.family).OWN)
            | {"snr_alone_coarse": ratio(fitted)}
        ]
    )
    return {
        "format": "surgisim-blind-truth/1",
        "recording": name,
        "seed": settings.seed,
        "case": settings.case,
        "family": settings.family,
        "kind": kind,
        "effects": effects,
        "log_evidence": surely,
        "snr": ratio(fitted),
        "snr_held_out": ratio(held),
        "noise": seeing.sigma,
        "base": {"E": law.E, "nu": law.nu, "eta": law.eta, "density": law.density},
        "body": {"kind": world.body.kind, "support": world.body.support, "thickness": world.body.thickness},
        "grips": [{"course": g.course, "handling": g.handling, "early": g.early, "late": g.late} for g in world.grips],
        "camera": seeing.camera,
        "phases": [{"begin": g.begin, "arrive": g.arrive, "release": g.release} for g in world.grips],
        "tracks_sha256": hashlib.sha256(tracks).hexdigest(),
    }
