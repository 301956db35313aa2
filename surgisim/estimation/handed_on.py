"""What an estimation hands on bears its whole clip with a margin.

Where tissue is all but inside out, rounding decides whether a replay of it breaks, on this machine or on the next.
"""

from dataclasses import replace

import numpy as np

from surgisim.estimation.rounds import GRIPS, TOO_VIOLENT
from surgisim.estimation.trial import Trial
from surgisim.mpm.carried import Carried
from surgisim.mpm.simulator import Breakdown, Run
from surgisim.problem import Problem

SQUEEZED, YIELDS = 0.05, 0.8
"""Least share of its volume to which what is handed on may be squeezed, and how much softer than the last each grip is
that is tried so that it holds; chosen."""


def handed_on(trial: Trial, x: np.ndarray, theta: np.ndarray, history: list) -> tuple[Trial, Run]:
    """The settled trial, whose body, theta (P, M), bears the whole clip, and the run of it.

    Of what squeezes tissue too far, the nearest gives way: grips a little at a time, a patch of the seen edge at once.
    Raises Problem when even without any patch the softest grip squeezes it too far.
    """
    values, body = trial.wanted.values(x), trial.bodies[0]
    particles = Carried(body.body.rest, body.simulator)
    while True:
        try:
            run = body.simulator.run(theta, trial.drive(values, stiffest=body.stiffest(theta)))
            volume = np.min([np.linalg.det(particles.at(u)[1]) for u in run.u], axis=0)
            if volume.min() >= SQUEEZED:
                return trial, run
            broke, particle = f"tissue is squeezed to {volume.min():.3f} of its volume", int(volume.argmin())
        except Breakdown as breakdown:
            broke, particle = str(breakdown), breakdown.particle
        history.append({"round": "grip", "share": trial.grip, "cost": None, "broke": broke})
        trial = _gives_way(trial, None if particle is None else body.body.rest[particle])


def _gives_way(trial: Trial, place: np.ndarray | None) -> Trial:
    """The trial with less of what pulls nearest to a place at rest [m], (3,); of grips where it is not known."""
    motion, softest = trial.motion, trial.grip < GRIPS[-1]
    if not len(motion.rim):
        if softest:
            raise Problem(TOO_VIOLENT)
        return replace(trial, grip=YIELDS * trial.grip)
    around = motion.rim[:, 0].mean(0) if place is None else place
    patch = np.linalg.norm(motion.rim[:, 0] - around, axis=1) - motion.rim_radius
    grips = np.linalg.norm(motion.center_rest - around, axis=1) - motion.radius
    if not softest and (place is None or grips.min(initial=np.inf) <= patch.min()):
        return replace(trial, grip=YIELDS * trial.grip)
    stays = np.arange(len(patch)) != patch.argmin()
    return replace(trial, motion=replace(motion, rim=motion.rim[stays], rim_radius=motion.rim_radius[stays]))
