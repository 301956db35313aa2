"""What may be missing and remembers: relaxation, plastic set, damage, a base that slid."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from surgisim.diagnosis.base import Base
from surgisim.diagnosis.clip import Clip
from surgisim.diagnosis.form import Block
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.laws import law_of, respond
from surgisim.diagnosis.memo import NOTHING_KEPT, Memo
from surgisim.diagnosis.tangent import base_piola, piola
from surgisim.estimation.trial import at_once
from surgisim.mpm.simulator import Breakdown
from surgisim.physics.catalogue import choose

TAUS = (0.1, 0.2, 0.4, 0.8, 1.6, 3.2)
YIELDS = (0.05, 0.08, 0.12, 0.17, 0.24)
TEARS = (0.05, 0.08, 0.12, 0.17, 0.24)
MOST = 0.8
"""Damage that is never exceeded, where a fit begins."""
CAPS = (0.015, 0.03, 0.05, 0.09, 0.16, 0.35)
"""Friction that a base is tried with, over the largest traction it bears: that is found in few places, below a grip."""
SMALL = 1e-3
STEPS = 2
"""Steps between two frames in which a memory advances."""


FORMS = (
    *(("relaxation", {"G": 1.0, "tau": t}) for t in TAUS),
    *(("plastic_set", {"yield_strain": y, "share": SMALL}) for y in YIELDS),
    *(("damage", {"onset": y, "rate": SMALL, "most": MOST}) for y in TEARS),
)


def remembering(clip: Clip, base: Base, forms=FORMS, memo: Memo = NOTHING_KEPT) -> Block:
    """Laws that remember: relaxation, plastic set, damage; followed along every frame."""
    columns = memo(["remembering", base.x.tolist(), forms], lambda: {"columns": _followed(clip, base, forms)})[
        "columns"
    ]
    eye = np.eye(len(forms))
    return Block(
        columns, [Hypothesis(n, eye[:, k : k + 1], 1, None, None, None, row) for k, (n, row) in enumerate(forms)]
    )


def _followed(clip: Clip, base: Base, forms) -> np.ndarray:
    """What the points do with each of the laws [m], (H, K, T_fit, 3)."""
    near, laws = base.tangent, choose(["relaxation", "plastic_set", "damage"])
    until, count = clip.until, len(base.prepared.simulator.rest)
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
    return np.stack([near.history(load) for load in loads])


def gliding(clip: Clip, base: Base, memo: Memo, workers: int) -> Iterator[Block]:
    """A base that holds by friction: where it slides depends on where it slid, so the engine runs a few caps."""
    near, simulator = base.tangent, base.prepared.simulator
    held, volume = clip.body.held, simulator.volume_p
    spring = clip.density * float(np.trace(base.drive.stiffness[0])) / 3
    across = np.eye(3) - np.outer(clip.normal, clip.normal)
    pull = max(float(np.linalg.norm(near.displacement(f)[held] @ across, axis=1).max()) for f in near.frames) * spring
    whole = float(volume[held].sum())
    caps = [{"cap": share * pull * whole, "stiffness": spring * whole} for share in CAPS]
    tried = [Hypothesis("sliding_base", np.ones((1, 1)), 1, None, None, None, about) for about in caps]

    def moved(h: Hypothesis, _worker: int) -> np.ndarray | None:
        try:
            return respond(clip, base, law_of(h, np.ones(1), clip), memo, clip.until)
        except Breakdown:
            return None

    answers = list(zip(tried, at_once(moved, tried, workers), strict=True))
    found = [h for h, answer in answers if answer is not None]
    columns = [answer - base.simulated[:, : clip.until] for _, answer in answers if answer is not None]
    if columns:
        eye = np.eye(len(columns))
        yield Block(np.stack(columns), [replace(h, mix=eye[:, k : k + 1]) for k, h in enumerate(found)])
