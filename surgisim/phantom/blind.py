"""Invent a recording that conceals something, and write down what.

Every part draws from a generator of its own, so that neither the scene nor the nuisances depend on the effect.
"""

import hashlib
import json
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from surgisim.config.invent import Concealing, Invent
from surgisim.phantom import folder, nuisance
from surgisim.phantom.effect import Hidden, catalogue, conceal, described
from surgisim.phantom.follow import follow
from surgisim.phantom.mixture import concealed
from surgisim.phantom.model import Model, model
from surgisim.phantom.scene import Hold, Scene, draw
from surgisim.phantom.snr import Found, scaled, signal
from surgisim.problem import Problem

Progress = Callable[[float, float, str], None]
PLACES = 3
"""Places that an effect may try before it is taken as strong as it gets."""
NEAR = 0.10
"""How near the fine run's ratio must come to the wanted one; otherwise it is run again."""
FINE_RUNS = 4
"""At most."""
WEAKER = 0.8
"""Times the strength of two effects that tissue does not bear at once, and of pulls, again and again until it does."""
SHORTER = 5
"""How often pulls are shortened at most."""


@dataclass(frozen=True)
class Invented:
    name: str
    recording: dict[str, bytes]
    """File name -> bytes of the recording's folder."""
    truth: bytes
    """truth.json: what is concealed; names the digest of `tracks`."""
    tracks: bytes
    """truth.npz: plain and true, noise-free paths without and with the effects [m], (K, T, 3) float32."""


@dataclass(frozen=True)
class Aim:
    """One effect with the ratio it was asked for and the one that quick runs give it alone."""

    hidden: Hidden
    asked: float
    alone: float


def name_of(seed: int, case: int) -> str:
    """Tells nothing of the case."""
    return "r-" + hashlib.sha256(f"{seed}/{case}".encode()).hexdigest()[:8]


def invent(settings: Invent, progress: Progress | None = None, names: tuple[str, ...] | None = None) -> Invented:
    """The case `settings.case` of `settings.seed`: the same bytes every time on one machine.

    `names` conceals these effects instead of what the mixture says, in the same scene with the same nuisances.
    Raises Problem when no place is found where the tissue bears the effect.
    """
    spacings = settings.spacing, settings.spacing_coarse
    drawn = draw(generator(settings, "scene"), fps=settings.fps, points=settings.points, spacings=spacings)
    if settings.lag is not None:
        drawn = drawn.lagging(settings.lag)
    drawn = drawn.between_frames(settings.close_phase, settings.release_phase)
    scene, models, (plain, quick) = borne(drawn, spacings, progress)
    free = nuisance.visible(scene, plain, generator(settings, "visible"))
    if names is None:
        names = concealed(settings.seed, settings.case, tuple(settings.only), settings.faint)
    true, aims, _ = with_effects(settings, models, names, (plain, quick), free, progress)
    rest = scene.shape.upper(scene.probes)
    seen = nuisance.seen(rest, true, settings.noise, generator(settings, "noise"))
    name = name_of(settings.seed, settings.case)
    files = folder.recording(scene, name, seen, free, settings.noise, models[0], plate=settings.plate)
    tracks = folder.npz(plain=plain.astype(np.float32), true=true.astype(np.float32))
    truth = told(settings, scene, name, aims, (plain, true), free, tracks)
    return Invented(name, files, (json.dumps(truth, indent=1, allow_nan=False) + "\n").encode(), tracks)


def generator(settings: Concealing, part: str) -> np.random.Generator:
    """For one part of one case."""
    return np.random.default_rng([settings.seed, settings.case, *part.encode()])


def ratio(
    settings: Concealing, scene: Scene, difference: np.ndarray, free: np.ndarray, *, held_out: bool = False
) -> float:
    """Signal over noise on the frames that are fitted, or on those held out."""
    span = slice(scene.split, None) if held_out else slice(0, scene.split)
    return signal(difference[:, span], free[:, span]) / max(settings.noise, 1e-9)


def borne(
    scene: Scene,
    spacings: tuple[float, float],
    progress: Progress | None,
    build: Callable[[Scene, float], Model] = model,
) -> tuple[Scene, tuple[Model, Model], tuple[np.ndarray, np.ndarray]]:
    """The scene, its pulls shortened until they tear nothing, its models, and paths without effects [m], (K, T, 3).

    Models and paths are those in elements of either spacing [m], which `build` makes. Raises Problem where even short
    pulls tear them.
    """

    def paths() -> tuple[Scene, tuple[Model, Model], tuple[np.ndarray, np.ndarray]]:
        fine, coarse = (build(scene, spacing) for spacing in spacings)
        plain = follow(fine, progress, "moving the tissue without the effect")
        return scene, (fine, coarse), (plain, follow(coarse, progress, "a quick run without the effect"))

    for _ in range(SHORTER):
        try:
            return paths()
        except Problem:
            scene = scene.pulled(WEAKER)
    return paths()


def with_effects(
    settings: Concealing, models: tuple[Model, Model], names: tuple[str, ...], plain: tuple[np.ndarray, np.ndarray],
    free: np.ndarray, progress: Progress | None,
) -> tuple[np.ndarray, tuple[Aim, ...], Model]:  # fmt: skip
    """Paths with the effects [m], (K, T, 3), the effects, and the model that holds them.

    models, plain: in fine and in coarse elements, the models without effects and their paths [m], (K, T, 3).
    free: which samples are seen, (K, T). Raises Problem where the tissue does not bear them.
    """
    (fine, coarse), (path, quick), scene = models, plain, models[0].scene
    if not names:
        return path, (), fine
    rng = generator(settings, "effect")

    def measure(*hidden: Hidden) -> float:
        try:
            moved = follow(conceal(coarse, hidden), progress, "a quick run to find how strong")
        except Problem:
            # The tissue does not bear it.
            return math.inf
        return ratio(settings, scene, moved - quick, free)

    aims = tuple(_aim(settings, scene, name, rng, measure) for name in names)
    # Fine elements answer a little differently from coarse ones; one factor for all effects mends that.
    wanted = _within_reach(aims[0])
    if len(aims) > 1:
        aims, wanted = at_once(aims, measure)
    runs: dict[float, tuple[np.ndarray, tuple[Hidden, ...]]] = {}

    def measure_fine(factor: float) -> float:
        hidden = tuple(_times(a.hidden, factor) for a in aims)
        try:
            true = follow(conceal(fine, hidden), progress, "moving the tissue with the effect")
        except Problem:
            return math.inf
        runs[factor] = true, hidden
        return ratio(settings, scene, true - path, free)

    most = max(catalogue()[a.hidden.name].most / a.hidden.magnitude for a in aims)
    found = scaled(measure_fine, wanted, start=1.0, most=most, close=NEAR, tries=FINE_RUNS)
    if not found.magnitude:
        raise Problem(
            f"phantom: case {settings.case} of seed {settings.seed}: the tissue does not bear {' and '.join(names)} in "
            "fine elements. Take another seed, or a lower snr_high."
        )
    true, hidden = runs[found.magnitude]
    aims = tuple(Aim(h, a.asked, a.alone) for h, a in zip(hidden, aims, strict=True))
    return true, aims, conceal(fine, hidden)


def _aim(settings: Concealing, scene: Scene, name: str, rng: np.random.Generator, measure) -> Aim:
    """An effect somewhere, as strong as asked, or as strong as it gets."""
    effect = catalogue()[name]
    share = rng.uniform()
    best = None
    for _ in range(PLACES):
        hidden = effect.draw(scene, rng, name)
        reach = measure(hidden.scaled(effect.most))
        if best is None or reach > best[1]:
            best = hidden, reach
        if reach > 1.1 * settings.snr_low:
            break
    hidden, reach = best
    if reach <= 1.1 * settings.snr_low:
        return Aim(hidden.scaled(effect.most), settings.snr_low, reach)
    top = max(min(settings.snr_high, 0.95 * reach), settings.snr_low)
    asked = settings.snr_low * (top / settings.snr_low) ** share
    found: Found = scaled(
        lambda magnitude: measure(hidden.scaled(magnitude)), asked, start=effect.start, most=effect.most
    )
    return Aim(hidden.scaled(found.magnitude), asked, found.ratio)


def at_once(aims: tuple[Aim, ...], measure: Callable[..., float]) -> tuple[tuple[Aim, ...], float]:
    """Effects as strong as tissue bears them together, and the ratio that they give; `measure` says inf beyond that."""
    while math.isinf(wanted := measure(*(a.hidden for a in aims))):
        weaker = [_times(a.hidden, WEAKER) for a in aims]
        aims = tuple(Aim(h, a.asked, measure(h)) for h, a in zip(weaker, aims, strict=True))
    return aims, wanted


def _within_reach(aim: Aim) -> float:
    """What was asked for, or what quick runs gave where that cannot be had."""
    return aim.asked if abs(math.log(aim.alone / aim.asked)) < NEAR else aim.alone


def _times(hidden: Hidden, factor: float) -> Hidden:
    return hidden.scaled(min(factor * hidden.magnitude, catalogue()[hidden.name].most))


def told(
    settings: Concealing, scene: Scene, name: str, aims: tuple[Aim, ...], paths: tuple[np.ndarray, np.ndarray],
    free: np.ndarray, tracks: bytes,
) -> dict:  # fmt: skip
    """What truth.json says. paths: plain and true [m], (K, T, 3); tracks: what truth.npz holds."""
    law, difference = scene.law, paths[1] - paths[0]
    kind = "nothing" if not aims else "two" if len(aims) == 2 else "one"
    if any(catalogue()[a.hidden.name].outside for a in aims):
        kind = "outside"
    return {
        "format": "surgisim-blind-truth/1",
        "recording": name,
        "seed": settings.seed,
        "case": settings.case,
        "kind": kind,
        "effects": [described(scene, a.hidden) | {"snr_asked": a.asked, "snr_alone_coarse": a.alone} for a in aims],
        "snr": ratio(settings, scene, difference, free),
        "snr_held_out": ratio(settings, scene, difference, free, held_out=True),
        "noise": settings.noise,
        "base": {"E": law.E, "nu": law.nu, "eta": law.eta, "density": law.density},
        "phases": [_phases(hold) for hold in scene.holds],
        "tracks_sha256": hashlib.sha256(tracks).hexdigest(),
    }


def _phases(hold: Hold) -> dict[str, float]:
    """The frames of a grip, and by how much it misses them where it closes or opens between frames."""
    missed = {"close_phase": hold.close_phase, "release_phase": hold.release_phase}
    frames = {"begin": hold.begin, "arrive": hold.arrive, "release": hold.release}
    return frames | {name: share for name, share in missed.items() if share}
