"""Known answers of the laws that remember, in the engine: all of them at once, each switched on in turn."""

from dataclasses import replace

import numpy as np
import pytest
from slab import pulled, slab

from surgisim.artifacts.motion import Motion
from surgisim.mpm.setup import prepare

FPS, DENSITY = 25.0, 1050.0
MU = 1000.0
BASE = {
    "corotated": {"E": 2 * MU * 1.4, "nu": 0.4},
    "newtonian": {"eta": 1.0},
    "relaxation": {"G": 0.0, "tau": 0.2},
    "plastic_set": {"yield_strain": 0.1, "share": 0.0},
    "damage": {"onset": 0.1, "rate": 0.0, "most": 1.0},
}


def tissue(**changed):
    return {law: {**values, **changed.get(law, {})} for law, values in BASE.items()}


def stable(made):
    """Steps a frame for the stiffest of these tissues."""
    return made.per_frame(tissue(relaxation={"G": MU}, newtonian={"eta": 3.0}), FPS)


def run(body, values, motion, held=None, gravity=(0.0, 0.0, 0.0)):
    made = prepare(body, tuple(values), density=DENSITY, gravity=gravity)
    drive = made.drive(motion, values, fps=FPS, per_frame=stable(made), held=held)
    return made, drive, made.simulator.run(made.theta(values), drive)


def nobody(frames):
    """No grip at all."""
    return Motion(
        np.zeros((0, 3)), np.zeros(0), np.zeros((0, frames, 3)), np.zeros((0, frames), bool), np.zeros(0), "none"
    )


def twice(by=(0.0, 0.0, -0.007)):
    """The same pull two times, with a rest between."""
    once = pulled(frames=20, hold=9, by=by)
    position = np.concatenate([once.position, once.position], 1)
    active = np.concatenate([once.active, once.active], 1)
    return replace(once, position=position, active=active)


def moved(made, out, points):
    """Displacement of rest points at every frame [m], (T, Q, 3)."""
    return np.array([made.simulator.grid.interpolate(made.simulator.displaced(u), points) for u in out.u])


def test_a_held_block_relaxes_as_a_standard_linear_solid():
    body = slab(size=(0.024, 0.024, 0.024))
    F, tau = np.eye(3) + np.array([[0.05, 0.3, 0.0], [0.0, 0.0, 0.1], [0.0, 0.0, -0.05]]), 0.2
    values = tissue(relaxation={"G": MU, "tau": tau})
    made = prepare(body, tuple(values), density=DENSITY)
    # Every particle is held where an even deformation puts it, by springs so stiff that the free faces hardly matter.
    all_of_it = np.ones(len(body.rest), bool)
    drive = made.drive(nobody(16), values, fps=FPS, per_frame=6 * stable(made), held=all_of_it)
    even = np.broadcast_to(F, (*drive.path.shape[:2], 3, 3)).copy()
    drive = replace(drive, turn=even, stiffness=30 * drive.stiffness)
    u = (made.simulator.grid.positions()[made.simulator.place] - drive.center[0]) @ (F - np.eye(3)).T
    out = made.simulator.run(made.theta(values), drive, begin=(u, 0 * u))
    middle = np.argmin(np.linalg.norm(body.rest - body.rest.mean(0), axis=1))
    squares, axes = np.linalg.eigh(F.T @ F)
    e = (axes * np.sqrt(squares)) @ axes.T
    e -= np.trace(e) / 3 * np.eye(3)
    time = np.arange(16) / FPS
    e = e[[0, 1, 0, 0, 1], [0, 1, 1, 2, 2]]
    left = 1 - out.q[:, middle, :5] @ e / (e @ e)
    assert np.allclose(left, np.exp(-time / tau), atol=0.01)


def test_tissue_under_a_constant_load_creeps_as_a_standard_linear_solid():
    """A long layer that its own weight shears: shear(t) / shear(end) = 1 - G / (mu + G) exp(-t mu / (tau (mu + G)))."""
    body = slab(size=(0.06, 0.006, 0.009), spacing=0.003)
    layer = np.array([[0.0, 0.0, 0.062], [0.0, 0.0, 0.065]])
    shear = {}
    for G in (0.0, MU):
        values = tissue(relaxation={"G": G, "tau": 0.2})
        made, _, out = run(body, values, nobody(31), gravity=(2.0, 0.0, 0.0))
        u = moved(made, out, layer)[..., 0]
        shear[G] = u[:, 0] - u[:, 1]
    wanted = 1 - 0.5 * np.exp(-np.arange(31) / FPS / 0.4)
    assert np.allclose((shear[MU] / shear[0.0][-1])[6:], wanted[6:], atol=0.01)


def test_a_set_stays_after_release_and_nothing_else_does():
    left = {}
    for share in (0.0, 0.6):
        body = slab()
        made, _, out = run(
            body, tissue(plastic_set={"share": share}, newtonian={"eta": 3.0}), pulled(frames=40, hold=6)
        )
        path = moved(made, out, np.array([[0.0, 0.0, 0.061]]))[:, 0]
        left[share] = np.linalg.norm(path[-1]) / np.linalg.norm(path[6])
    assert left[0.0] < 0.01
    assert left[0.6] > 0.1


def test_damage_makes_the_second_pull_easier():
    ratio = {}
    for rate in (0.0, 2.0):
        body = slab()
        made, drive, out = run(body, tissue(damage={"rate": rate}, newtonian={"eta": 3.0}), twice())
        halfway = 3
        ratio[rate] = pull(made, drive, out, 20 + halfway) / pull(made, drive, out, halfway)
    assert ratio[0.0] == pytest.approx(1.0, abs=0.01)
    assert ratio[2.0] < 0.9


def pull(made, drive, out, frame):
    """Force of the grip on the tissue [N], from how far its springs are stretched."""
    simulator, step = made.simulator, frame * drive.per_frame
    mine = (drive.member >> 1) & 1 == 1
    x = simulator.grid.interpolate(simulator.displaced(out.u[frame]), simulator.rest[mine])
    away = drive.path[1, step] - x
    volume = (drive.share * simulator.volume_p)[mine][:, None]
    return np.linalg.norm((DENSITY * volume * away).sum(0) @ drive.stiffness[1])


def test_all_of_them_together_run_and_stay_finite():
    on = {"relaxation": {"G": MU}, "plastic_set": {"share": 0.3}, "damage": {"rate": 1.0}}
    out = run(slab(), tissue(**on), twice())[2]
    assert np.isfinite(out.u).all()
    assert out.q.shape[2] == 5 + 6 + 1
    strain = out.q[..., -1]
    assert (np.diff(strain, axis=0) >= 0).all()
    assert strain[-1].max() > 0.1
