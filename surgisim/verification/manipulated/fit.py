"""Parameters fitted to the finite elements' tracks of a scene, as a clip's are to a tracker's."""

from dataclasses import dataclass, replace

import numpy as np

from surgisim.config.estimation import Estimation
from surgisim.estimation.gauss_newton import Solution
from surgisim.estimation.observation import Observation, phases
from surgisim.estimation.rounds import descend, windows
from surgisim.estimation.search import search
from surgisim.estimation.starts import choose_starts
from surgisim.estimation.trial import WORKERS, Trial, at_once
from surgisim.mpm.setup import Values, prepare
from surgisim.phantom.elements import elements
from surgisim.phantom.ogrid import Mesh
from surgisim.physics.place import Place
from surgisim.verification.manipulated import elements as finite
from surgisim.verification.manipulated import particles
from surgisim.verification.manipulated.scene import DENSITY, FINE, FPS, Scene

NOISE = 1e-4
"""Standard deviation of each coordinate of a tracked point [m]."""
MODEL = 0.1
"""Standard deviation granted to the difference between the two solvers, as a share of how far a point has gone. It is
twice what `manipulation` finds, because it is alike over many points and frames, and so counts for more than noise."""
COARSER = 1.5
"""How many times coarser the grid is on which a start is chosen."""
SOFT = 1.5e-3
"""Width over which one region passes into the other [m]."""


@dataclass(frozen=True)
class Halves:
    """Tissue on one side of a plane is stiffer."""

    center: np.ndarray
    """A point of the plane [m], (3,)."""
    normal: np.ndarray
    """Into the stiffer side, (3,)."""
    ratio: float
    """How many times stiffer."""

    @property
    def place(self) -> Place:
        return Place(tuple(self.center), SOFT, tuple(self.normal))


def halves(scene: Scene) -> Halves:
    """Where a seed's block is stiffer: beyond a plane that stands upright between its two grips."""
    rng = np.random.default_rng([scene.seed, *b"halves"])
    first, second = (h.grip.uv for h in scene.holds)
    along = (second - first) / np.linalg.norm(second - first) * rng.choice([-1.0, 1.0])
    normal = along @ scene.shape.axes[:2]
    middle = first + rng.uniform(0.2, 0.5) * (second - first)
    return Halves(scene.shape.upper(middle), normal, float(np.exp(rng.uniform(np.log(1.5), np.log(3.0)))))


def tracked(scene: Scene, spacing: float, probes: np.ndarray, split: Halves | None, frames: int) -> np.ndarray:
    """Displacement of `probes` by finite elements at every frame [m], (frames, K, 3)."""

    def parts(block: Mesh):
        built = elements(block.points, block.cells, scene.law)
        if split is None:
            return built
        middle = block.points[np.moveaxis(built.cells, 1, -1)].mean(2)
        stiffer = 1 + (split.ratio - 1) * split.place.weight(middle.reshape(-1, 3)).reshape(built.mu.shape)
        return replace(built, mu=built.mu * stiffer, lam=built.lam * stiffer)

    return finite.follow(scene, spacing, probes, frames=frames, parts=parts)[::FINE]


def fitted(
    scene: Scene,
    spacing: float,
    seen: np.ndarray,
    split: Halves | None,
    last: int,
    *,
    noise: float = NOISE,
    seed: int = 0,
) -> tuple[Trial, Solution]:
    """The laws' parameters from the tracks `seen` (T, K, 3) of the scene's probes at frames 1 to `last`.

    The best of a few starts is chosen on a grid COARSER times as wide, where a grip may be too wide to fit more.
    """
    rough, fine = (trial(scene, h, seen, split, last, noise=noise, seed=seed) for h in (COARSER * spacing, spacing))
    phase, settings = phases(fine.motion, fine.frames), Estimation(iterations=6, first_window=1.0)
    begin = choose_starts(rough, rough.wanted.start, [], lambda *_: None)[0]
    return descend(fine, begin, windows(fine.fitted, phase, settings.first_window), settings, [], lambda *_: None)


def mistaken(at_truth: Trial) -> np.ndarray:
    """Where one step of Gauss and Newton leads from the truth, which the trial's search starts from, (M,).

    That is what the difference between the two solvers does to parameters fitted to such a scene.
    """
    x, step = at_truth.wanted.start, 0.01
    sides = [x + s * step * e for e in np.eye(len(x)) for s in (1, -1)]
    here, *around = at_once(at_truth.residual, [x, *sides])
    jacobian = np.stack([(up - down) / (2 * step) for up, down in zip(around[::2], around[1::2], strict=True)], -1)
    return -np.linalg.solve(jacobian.T @ jacobian, jacobian.T @ here)


def trial(
    scene: Scene,
    spacing: float,
    seen: np.ndarray,
    split: Halves | None,
    last: int,
    *,
    noise: float = NOISE,
    seed: int = 0,
    start: Values | None = None,
) -> Trial:
    """Bodies of `spacing` [m] beside noisy tracks of points that no grip holds; `start`: where the search begins."""
    probes = scene.probes()
    terms = [*particles.TERMS, *(["stiff_inclusion"] if split else [])]
    places = {"stiff_inclusion": split.place} if split else {}
    points = scene.shape.upper(probes)
    body = particles.body(scene, spacing)
    motion = particles.motion(scene, len(seen), fine=1)
    bodies = [
        prepare(body, tuple(terms), density=DENSITY, carried=points, places=places, grips=motion)
        for _ in range(WORKERS)
    ]
    away = [np.linalg.norm(points - c, axis=1) > r for c, r in zip(motion.center_rest, motion.radius, strict=True)]
    free = np.logical_and.reduce(away)
    shown = np.moveaxis(seen, 0, 1)[free]
    noisy = shown + np.random.default_rng([seed, *b"tracks"]).normal(0, noise, shown.shape)
    noisy[:, 0] = 0.0
    weight = 1 / np.sqrt(noise**2 + (MODEL * np.linalg.norm(noisy, axis=-1, keepdims=True)) ** 2) * np.ones(3)
    observation = Observation(points[free], noisy, weight, bodies[0].simulator.carry(points[free]).tocsr())
    begin = start or ({"stiff_inclusion": {"s": 1.0}} if split else {})
    wanted = search(terms, begin, [])
    return Trial(bodies, wanted, motion, observation, body.held, FPS, len(seen), np.arange(1, last + 1))


def truth(scene: Scene, split: Halves | None) -> Values:
    """The laws' parameters that the finite elements had."""
    law, values = scene.law, {"stiff_inclusion": {"s": split.ratio}} if split else {}
    return {particles.TERMS[0]: {"E": law.E, "nu": law.nu}, particles.TERMS[1]: {"eta": law.eta}} | values


def phase_of(trial: Trial) -> np.ndarray:
    """Phase of every residual of a trial's fit, (R,), an index into PHASES."""
    phase = phases(trial.motion, trial.frames)[trial.fitted]
    return np.broadcast_to(phase[None, :, None], (len(trial.observation.rest), len(trial.fitted), 3)).ravel()
