"""What a body cannot bear gives way: a grip that holds too firmly, a patch of the seen edge that runs into another."""

from dataclasses import replace

import numpy as np

from surgisim.estimation.trial import Trial
from surgisim.mpm.carried import Carried
from surgisim.mpm.setup import Values
from surgisim.mpm.simulator import Breakdown, Run
from surgisim.problem import Problem

GRIPS = (1.0, 0.3, 0.1, 0.03, 0.01)
"""How firmly instruments may hold, tried in turn."""
SQUEEZED, YIELDS = 0.05, 0.8
"""Least share of its volume to which what is handed on may be squeezed, and how much softer than the last each grip is
that is tried so that it holds; chosen."""
TOO_VIOLENT = (
    "estimation: the body turns inside out under the recorded motion however softly it is held. Check the grip and its "
    "path (tracking), or give it (--grasp)."
)


def borne(trial: Trial, x: np.ndarray, history: list, last: int | None = None) -> tuple[Trial, Run]:
    """The trial with the firmest hold, not firmer than its own, that can be simulated at x, at the longest step that it
    bears there, and the run of it at the stable one: of the whole clip, or of what a misfit up to frame `last` asks.

    Tracks at the jaws are the worst there are, and a firm grip that follows them can turn the tissue inside
    out; a softer one lets it slip. Raises Problem when even the softest does not help.
    """
    while True:
        try:
            return trial.striding(x, last)
        except Breakdown as breakdown:
            trial = softer(trial, x, history, breakdown)


def softer(trial: Trial, x: np.ndarray, history: list, breakdown: Breakdown) -> Trial:
    """The trial in which the nearest to where it broke down at x gives way; raises Problem where nothing is left."""
    history.append({"round": "grip", "share": trial.grip, "cost": None, "broke": str(breakdown)})
    place = None
    if breakdown.particle is not None:
        place = trial.stand(x)[0].bodies[0].body.rest[breakdown.particle]
    return _gives_way(trial, place, next((g for g in GRIPS if g < trial.grip), None))


def handed_on(trial: Trial, values: Values, theta: np.ndarray, history: list) -> tuple[Trial, Run]:
    """The settled trial, whose body, theta (P, M), bears the whole clip with a margin, and the run of it; values: the
    laws' numbers that it is held for.

    Where tissue is all but inside out, rounding decides whether a replay of it breaks, on this machine or on the next.
    Raises Problem when even without any patch of the edge the softest grip squeezes it too far.
    """
    while True:
        try:
            return trial, with_margin(trial, values, theta)
        except Breakdown as breakdown:
            history.append({"round": "grip", "share": trial.grip, "cost": None, "broke": str(breakdown)})
            place = None if breakdown.particle is None else trial.bodies[0].body.rest[breakdown.particle]
            trial = _gives_way(trial, place, YIELDS * trial.grip if trial.grip >= GRIPS[-1] else None)


def with_margin(trial: Trial, values: Values, theta: np.ndarray) -> Run:
    """The whole clip of a settled trial, see `handed_on`; raises Breakdown where its body does not bear it."""
    body = trial.bodies[0]
    run = body.simulator.run(theta, trial.drive(values, stiffest=body.stiffest(theta)))
    particles = Carried(body.body.rest, body.simulator)
    volume = np.min([np.linalg.det(particles.at(u)[1]) for u in run.u], axis=0)
    if volume.min() < SQUEEZED:
        raise Breakdown(f"tissue is squeezed to {volume.min():.3f} of its volume", particle=int(volume.argmin()))
    return run


def _gives_way(trial: Trial, place: np.ndarray | None, grip: float | None) -> Trial:
    """The trial with less of what passes nearest to a place at rest [m], (3,): grips hold `grip`, or a patch of the
    edge lets go. Where the place is not known, grips are first; None: they cannot hold less."""
    motion = trial.motion
    place = motion.rim[:, 0].mean(0) if place is None and grip is None and len(motion.rim) else place
    to_grips, to_patches = np.zeros(len(motion.radius)), np.full(len(motion.rim), np.inf)
    if place is not None:
        to_grips = _passes(place, motion.position, motion.radius)
        to_patches = _passes(place, motion.rim, motion.rim_radius)
    if grip is not None and to_grips.min(initial=np.inf) <= to_patches.min(initial=np.inf):
        return replace(trial, grip=grip)
    if not len(to_patches):
        raise Problem(TOO_VIOLENT)
    stays = np.arange(len(to_patches)) != to_patches.argmin()
    return replace(trial, motion=replace(motion, rim=motion.rim[stays], rim_radius=motion.rim_radius[stays]))


def _passes(place: np.ndarray, path: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """How near balls (J,) that go along paths (J, T, 3) come to a place, from their skin [m], (J,)."""
    return np.linalg.norm(path - place, axis=-1).min(1, initial=np.inf) - radius
