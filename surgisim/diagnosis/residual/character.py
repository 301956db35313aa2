"""How a residual law behaves, read off its form, its course and its work on the moving tissue."""

from dataclasses import replace

import numpy as np

from surgisim.artifacts.character import Character
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.joint import Joint
from surgisim.diagnosis.laws import joined, law_of, run_with
from surgisim.diagnosis.residual import courses
from surgisim.diagnosis.tangent import piola
from surgisim.mpm.setup import Prepared
from surgisim.mpm.simulator import Run
from surgisim.physics.catalogue import Term, choose

SLOW = 0.4
"""Time in which something comes beyond which it is said to grow [s]; chosen: about three times what a load takes."""
THERE = 0.1
"""Share of a course's largest value above which it is there; chosen."""
NET = 0.2
"""Of the work that is done to and fro, what must be left over to be called given or taken; chosen."""


def character(case, found: Joint) -> Character:
    """Of the first law; its energy is that of all of them together. Raises what is IMPOSSIBLE."""
    h = found.refits[0].finding.hypothesis
    in_time = "rhythm" in h.about
    course = courses.of(h) if in_time else None
    period = h.about["period"] if course and course.rhythm > 0 else None
    return Character(
        at_rest=_at_rest(case, course.on(case.clip.time[: case.clip.until])) if course else False,
        change=None if period else _change(h),
        energy=energy(work(case, found)),
        local=h.place is not None and h.place.normal is None,
        period=period,
    )


def _at_rest(case, course: np.ndarray) -> bool | None:
    """Whether what time alone decides, (T,), was also there while no grip held."""
    there = np.abs(course) > THERE * np.abs(course).max()
    return True if (there & ~case.clip.held[: case.clip.until]).any() else None


def _change(h: Hypothesis) -> str:
    if "tau" in h.about:
        return "fades"
    if "rhythm" in h.about and (h.end is not None or h.about["fade"] < courses.LASTING):
        return "fades"
    return "grows" if h.onset is not None and h.about["rise"] > SLOW else "holds"


def energy(steps: np.ndarray) -> str:
    """steps: work on the tissue from frame to frame [J], (T - 1,)."""
    net = float(steps.sum()) / max(float(np.abs(steps).sum()), 1e-30)
    return "neither" if abs(net) < NET else "gives" if net > 0 else "takes"


def work(case, found: Joint) -> np.ndarray:
    """What the laws do on the tissue between fitted frames [J], (T - 1,), as the engine moves it."""
    clip, laws = case.clip, []
    for r in found.refits:
        laws.append(law_of(r.finding.hypothesis, r.amplitude, clip))
    both = joined(laws)
    prepared, run = run_with(clip, replace(case.base, x=found.x), both, clip.until)
    total = np.zeros(clip.until - 1)
    for name, values in both.values.items():
        place = both.places.get(name)
        share = np.ones(len(prepared.simulator.rest)) if place is None else place.weight(prepared.simulator.rest)
        total += work_of(choose([name])[name], values, share, prepared, run, 1 / clip.fps)
    return total


def work_of(law: Term, values: dict[str, float], share: np.ndarray, prepared: Prepared, run: Run, step: float):
    """Of one law that acts by `share`, (P,), between the frames of a run, `step` apart [s]: [J], (T - 1,)."""
    simulator, row = prepared.simulator, law.row(values)
    volume = simulator.volume_p
    index, link = simulator.rest_links
    q = np.zeros((len(volume), law.memory))
    done, before = [], None
    for n, u in enumerate(run.u):
        nodes = u.astype(float)[index]
        moved = np.einsum("pk,pki->pi", link[..., 0], nodes)
        F = np.eye(3) + np.einsum("pki,pkj->pij", nodes, link[..., 1:])
        if law.force is not None:
            load = law.twin(moved, 0 * moved, q, 0.0, n * step, **row) * (share / (share * volume).sum())[:, None]
            where = moved
        else:
            if law.twin_advance is not None and n:
                q = law.twin_advance(F, 0 * F, moved, q, step, **row)
            load, where = -share[:, None, None] * piola(law, F, row, q, n * step), F
        if before is not None:
            each = 0.5 * (load + before[0]) * (where - before[1])
            done.append(float(volume @ each.reshape(len(volume), -1).sum(1)))
        before = load, where
    return np.array(done)
