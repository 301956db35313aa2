"""How the estimation's cost grows with the clip: one, two and four times the frames.

A slab is pulled, held and let go, again and again; its parameters are planted, forgotten and searched: the scan of
starts and the descents over growing windows, as in every estimation. The paper begins anew from frame 0 for every few
further frames, which is O(n^2). Ours doubles its window from round to round.

Error model: all windows together are at most twice the last, so the simulated frames, and with them the processor's
time, grow in proportion to the clip: a slope of 1 in a log-log plot, less what does not depend on the clip.
"""

import time

import numpy as np

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.tracks import Tracks
from surgisim.config.estimation import Estimation
from surgisim.estimation.observation import observe, phases
from surgisim.estimation.rounds import descend, windows
from surgisim.estimation.search import search
from surgisim.estimation.starts import choose_starts
from surgisim.estimation.trial import Trial
from surgisim.mpm.setup import prepare
from surgisim.verification.drawing import COLORS, panels
from surgisim.verification.markdown import table

TITLE = "Estimation against the length of the clip"

FPS, PERIOD, NOISE = 25.0, 20, 5e-5
TRUE = {"corotated": {"E": 900.0, "nu": 0.38}, "newtonian": {"eta": 1.2}}
SPACING, SIZE = 0.006, (0.036, 0.036, 0.018)
CAMERA = Camera(64, 48, 80.0, 80.0, 31.5, 23.5, FPS, 1, "known", "given", "slab", [64, 48], [0, 0, 64, 48])


def measure(progress, quick: bool = False) -> dict:
    rows = []
    for done, times in enumerate((1, 2) if quick else (1, 2, 4)):
        progress(done, 3, f"{times * PERIOD} frames")
        rows.append(fit(times * PERIOD))
    lengths, seconds, frames = (np.log([r[k] for r in rows]) for k in ("frames", "seconds", "simulated"))
    slope = [float(np.polyfit(lengths, y, 1)[0]) for y in (seconds, frames)]
    return {"true": TRUE, "rows": rows, "slope_seconds": slope[0], "slope_simulated": slope[1]}


def fit(frames: int) -> dict:
    """One search: processor time [s], frames simulated, and what was found."""
    planted, ledger = trial(frames)
    wanted, settings, begun = planted.wanted, Estimation(first_window=0.25, field_iterations=0), time.process_time()
    begin = choose_starts(planted, wanted.start, [], lambda *_: None)[0]
    ends = windows(planted.fitted, phases(planted.motion, frames), settings.first_window)
    _, solution = descend(planted, begin, ends, settings, [], lambda *_: None)
    seconds = time.process_time() - begun
    found = wanted.values(solution.x)
    return {
        "frames": frames,
        "seconds": seconds,
        "runs": len(ledger),
        "simulated": sum(ledger),
        "E": found["corotated"]["E"],
        "nu": found["corotated"]["nu"],
        "eta": found["newtonian"]["eta"],
    }


def trial(frames: int) -> tuple[Trial, list[int]]:
    """A clip whose truth is TRUE, to be searched, and where the frames that each of its runs simulates are noted."""
    body, motion = _slab(), _pulls(frames)
    points = body.rest[body.surface].astype(float)
    bodies = [prepare(body, tuple(TRUE), density=1050.0, carried=points) for _ in range(2)]
    tracks = _tracks(bodies[0], motion, points, frames)
    ledger: list[int] = []
    observation = observe(tracks, motion, CAMERA, bodies[0].simulator, floor=1e-5)
    wanted = search(list(TRUE), {}, [])
    counted = _Counted(
        bodies, wanted, motion, observation, body.held, FPS, frames, np.arange(1, frames), 1.0, ledger=ledger
    )
    return counted, ledger


class _Counted(Trial):
    """A trial that notes how many frames each of its runs simulated."""

    def __init__(self, *args, ledger: list[int]) -> None:
        super().__init__(*args)
        object.__setattr__(self, "ledger", ledger)

    def _run(self, x, worker, last):
        run, observation = super()._run(x, worker, last)
        self.ledger.append(len(run.u) - 1)
        return run, observation

    def closely(self, x, since, last, within, worker=0):
        self.ledger.append(last)
        return super().closely(x, since, last, within, worker)


def _slab() -> Body:
    n = np.round(np.array(SIZE) / (SPACING / 2)).astype(int)
    axes = [(np.arange(k) + 0.5) * SPACING / 2 for k in n]
    rest = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3) - [SIZE[0] / 2, SIZE[1] / 2, -0.06]
    top, held = rest[:, 2] < 0.06 + SPACING / 2, rest[:, 2] > 0.06 + SIZE[2] - SPACING / 2
    volume = np.full(len(rest), (SPACING / 2) ** 3)
    color = np.full(rest.shape, 0.5)
    return Body(rest.astype(np.float32), volume.astype(np.float32), color.astype(np.float32), top, held, SPACING)


def _pulls(frames: int) -> Motion:
    """A grip that is carried for 5 frames, holds for 3, lets go, and comes again after every PERIOD frames."""
    t = np.arange(frames) % PERIOD
    s = np.clip(t / 5, 0, 1)
    path = (s * s * (3 - 2 * s))[:, None] * np.array([0.003, 0.0, -0.006])
    center = np.array([[0.0, 0.0, 0.06]])
    return Motion(center, np.array([0.0065]), (center + path)[None], (t <= 8)[None], np.ones(1), "given")


def _tracks(made, motion: Motion, points: np.ndarray, frames: int) -> Tracks:
    path = made.drive(motion, TRUE, fps=FPS, per_frame=2 * made.per_frame(TRUE, FPS))
    run = made.simulator.run(made.theta(TRUE), path)
    carry = made.simulator.carry(points)
    xyz = np.stack([points + carry @ u.astype(float) for u in run.u], 1)
    xyz[:, 1:] += np.random.default_rng(0).normal(0, NOISE, xyz[:, 1:].shape)
    shape = xyz.shape[:2]
    return Tracks(
        CAMERA.project(xyz).astype(np.float32), np.ones(shape, bool), np.full(shape, 0.1, np.float32),
        xyz.astype(np.float32), np.full((*shape, 2), NOISE, np.float32),
    )  # fmt: skip


def draw(result: dict):
    figure, (left, right) = panels(2)
    frames = np.array([r["frames"] for r in result["rows"]])
    for ax, what, label, slope in (
        (left, "seconds", "processor time [s]", result["slope_seconds"]),
        (right, "simulated", "frames simulated", result["slope_simulated"]),
    ):
        y = np.array([r[what] for r in result["rows"]], float)
        ax.loglog(frames, y, "o-", color=COLORS[0], label=f"slope {slope:.2f}")
        ax.loglog(frames, y[0] * frames / frames[0], "--", color=COLORS[1], linewidth=1, label="O(n)")
        ax.loglog(frames, y[0] * (frames / frames[0]) ** 2, ":", color=COLORS[2], linewidth=1, label="O(n^2)")
        ax.set(xlabel="frames of the clip", ylabel=label, title=TITLE if ax is left else "")
        ax.set_xticks(frames, [str(n) for n in frames])
        ax.set_xticks([], minor=True)
        ax.legend(frameon=False, fontsize=8)
    return figure


def words(result: dict) -> str:
    rows = [
        [
            r["frames"],
            f"{r['seconds']:.1f}",
            r["runs"],
            r["simulated"],
            f"{r['E']:.0f}",
            f"{r['nu']:.3f}",
            f"{r['eta']:.2f}",
        ]
        for r in result["rows"]
    ]
    true = f"{TRUE['corotated']['E']:.0f} Pa, {TRUE['corotated']['nu']}, {TRUE['newtonian']['eta']} Pa s"
    return f"""
A slab whose parameters are planted ({true}) is pulled and let go every {PERIOD} frames; its search is timed. Slope of
the processor's time {result["slope_seconds"]:.2f}, of the simulated frames {result["slope_simulated"]:.2f}; 1 is O(n).

{table(["frames", "processor time [s]", "runs", "frames simulated", "E [Pa]", "nu", "eta [Pa s]"], rows)}"""
