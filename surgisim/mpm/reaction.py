"""What anchors pull on tissue: the forces that an instrument, or a load cell below what is held, would measure."""

import numpy as np

from surgisim.mpm.closing import closings, shifted
from surgisim.mpm.grip import Drive
from surgisim.mpm.simulator import Run, Simulator


def reactions(simulator: Simulator, drive: Drive, run: Run) -> np.ndarray:
    """Force of every anchor on the tissue in every frame of a run from frame 0 on [N], (1 + J, T, 3).

        f_a = sum over particles of  V s_a rho K_a (path_a - u)                                     [N]

    That of the springs by which they hold it (grip.py); zero where one does not hold. Anchors that turn are not known
    here. Paths count from where grips find their tissue, as in `closing.follow`.
    """
    for frame in sorted({frame for _, frame, _ in closings(drive)}):
        if frame < len(run.u):
            drive = shifted(simulator, drive, frame, run.u[frame])
    volume, found = simulator.volume_p * drive.share, np.zeros((len(drive.path), len(run.u), 3))
    carry = simulator.carry_rest()
    for a in range(len(drive.path)):
        mine = np.flatnonzero(drive.member >> a & 1)
        weight, rows = volume[mine], carry[mine]
        for t, u in enumerate(run.u):
            hold = drive.hold[a, min(max(t * drive.per_frame - 1, 0), drive.steps - 1)]
            if hold > 0:
                away = weight.sum() * drive.path[a, t * drive.per_frame] - weight @ (rows @ u.astype(float))
                found[a, t] = hold * simulator.density * drive.stiffness[a] @ away
    return found
