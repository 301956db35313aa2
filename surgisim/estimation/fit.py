"""The whole estimation: rounds of growing windows, then a field where it pays, then what is known.

The paper restarts from frame 0 for every k further frames, which costs O(n^2). Here each round's
window is twice the last, so all rounds together cost at most twice the last one: O(n).
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.fit import Fit
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.masks import Masks
from surgisim.artifacts.material import Material
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.physics import Physics
from surgisim.artifacts.scene import Scene
from surgisim.artifacts.tracks import Tracks
from surgisim.config.estimation import Estimation
from surgisim.estimation.gauss_newton import gauss_newton, scan
from surgisim.estimation.identify import identifiability, in_words
from surgisim.estimation.observation import PHASES, fitted_frames, observe, phases
from surgisim.estimation.picture import picture_loss
from surgisim.estimation.refine import refine
from surgisim.estimation.search import Search, search
from surgisim.mpm.setup import Prepared, Values, prepare
from surgisim.mpm.simulator import Breakdown
from surgisim.physics.catalogue import choose, columns

WORKERS = 2
INDEPENDENT = 0.02
"""Share of residuals counted as independent: neighbouring points and frames share their tracking error."""
SAFETY = 0.9
"""Share of the largest stable step that is used."""


def estimate(
    body: Body,
    scene: Scene,
    tracks: Tracks,
    motion: Motion,
    frames: Frames,
    masks: Masks,
    camera: Camera,
    settings: Estimation,
    progress: Callable[[float, float, str], None],
) -> tuple[Material, Physics, Fit]:
    """Material, physics and fit of one clip.

    Without a grip, or without motion, nothing drives the body and nothing can be learned: the
    parameters stay at their start values, and the fit says so.
    """
    wanted = search(settings.terms, settings.start, settings.fixed)
    carried = np.concatenate([scene.mean, tracks.xyz[:, 0][np.isfinite(tracks.xyz[:, 0]).all(1)]]).astype(float)
    bodies = [
        prepare(
            body, tuple(settings.terms), density=settings.density,
            gravity=settings.gravity, carried=carried, device=settings.device,
        )
        for _ in range(WORKERS)
    ]  # fmt: skip
    if not len(motion.radius):
        return _unfitted(bodies[0], wanted, settings, camera, "No instrument was found that holds tissue: nothing "
                         "drives the body, so its physics cannot be learned from this clip.")  # fmt: skip
    observation = observe(tracks, motion, bodies[0].simulator, floor=0.02 * body.spacing)
    total = len(frames.rgb)
    phase = phases(motion, total)
    fitted = fitted_frames(frames.split)
    held_out = np.setdiff1d(np.arange(1, total), fitted)
    moved = np.linalg.norm(motion.position - motion.position[:, :1], axis=-1).max()
    if moved < 0.05 * body.spacing:
        return _unfitted(bodies[0], wanted, settings, camera, "The grip hardly moves: there is no motion to learn "
                         "the physics from.")  # fmt: skip

    def simulate(x: np.ndarray, worker: int, last: int):
        values = wanted.values(x)
        prepared = bodies[worker]
        per_frame = prepared.per_frame(values, camera.fps, SAFETY)
        path = prepared.drive(motion, values, fps=camera.fps, per_frame=per_frame, frames=total)
        return prepared.simulator.run(prepared.theta(values), path, last=last)

    default = simulate(wanted.start, 0, total - 1)
    before = observation.error(default.u, held_out)
    x, history = wanted.start, []
    if settings.enabled and wanted.free:
        windows = _windows(motion, fitted, settings.first_window)

        def residual(x, worker, last=int(fitted[-1])):
            try:
                run = simulate(x, worker, last)
            except Breakdown:
                return None
            return observation.residual(run.u, fitted[fitted <= last]).ravel()

        points = wanted.starts()
        progress(0.02, 1.0, f"trying {len(points)} starts")
        x, costs = scan(residual, points, prior=wanted.start, spread=wanted.spread, share=INDEPENDENT, workers=WORKERS)
        for point, cost in zip(points, costs, strict=True):
            tried = dict(zip(wanted.names, _plain(wanted, point), strict=True))
            history.append({"round": "scan", "cost": _number(cost)} | tried)
        for number, last in enumerate(windows):

            def said(iteration, x, cost, number=number, last=last):
                values = {n: float(f"{v:.4g}") for n, v in zip(wanted.names, _plain(wanted, x), strict=True)}
                history.append(
                    {"round": number, "last_frame": int(last), "iteration": iteration, "cost": cost, **values}
                )
                done = 0.2 + 0.5 * (number + iteration / settings.iterations) / len(windows)
                progress(done, 1.0, f"round {number + 1}/{len(windows)}, iteration {iteration}: {values}")

            solution = gauss_newton(
                partial(residual, last=last), x, prior=wanted.start if last == fitted[-1] else x,
                spread=wanted.spread, bounds=wanted.bounds,
                share=INDEPENDENT, iterations=settings.iterations, workers=WORKERS, said=said,
            )  # fmt: skip
            x = solution.x
        phase_of = np.broadcast_to(phase[fitted][None, :, None], (len(observation.rest), len(fitted), 3)).ravel()
        thickness = float(np.ptp(body.rest[:, 2]))
        table = identifiability(
            solution, wanted, phase_of=phase_of, phase_names=PHASES, density=settings.density, length=thickness,
            independent=INDEPENDENT,
        )  # fmt: skip
    else:
        table = {}
    values = wanted.values(x)
    prepared = bodies[0]
    names = columns(choose(prepared.terms))
    theta = prepared.theta(values)
    refinement = None
    chosen = [names.index(n) for n in settings.field if n in names and n in wanted.names]
    if settings.enabled and settings.field_iterations and chosen:
        per_frame = prepared.per_frame(values, camera.fps, SAFETY / 1.5)
        path = prepared.drive(motion, values, fps=camera.fps, per_frame=per_frame, frames=int(fitted[-1]) + 1)
        judge, train = fitted[2::4], np.setdiff1d(fitted, fitted[2::4])
        shown = np.sort(np.random.default_rng(settings.seed).permutation(train)[: settings.image_frames])
        image = (
            picture_loss(scene, camera, frames.rgb, masks.tissue & ~masks.specular, prepared.simulator, shown)
            if settings.image_weight > 0 and len(shown)
            else None
        )
        ends = [p for t in choose(prepared.terms).values() for p in t.params.values()]
        refinement = refine(
            prepared.simulator, path, theta, chosen, observation, train=train, judge=judge, image=image,
            image_weight=settings.image_weight, iterations=settings.field_iterations, smoothness=settings.smoothness,
            limits=(np.array([p.low for p in ends]), np.array([p.high for p in ends])),
            progress=lambda done, of, text: progress(0.7 + 0.25 * done / of, 1.0, text),
        )  # fmt: skip
        theta = refinement.theta
        history += [{"round": "field", **h} for h in refinement.history]
    top = {n: float(theta[:, k].max()) for k, n in enumerate(names)}
    stiffest = {law: {p: top[f"{law}.{p}"] for p in t.params} for law, t in choose(prepared.terms).items()}
    per_frame = prepared.per_frame(stiffest, camera.fps, SAFETY)
    path = prepared.drive(motion, values, fps=camera.fps, per_frame=per_frame, frames=total)
    final = prepared.simulator.run(theta, path)
    after = observation.error(final.u, held_out)
    progress(1.0, 1.0, f"held-out track error {after * 1e3:.3f} mm ({before * 1e3:.3f} mm with default parameters)")
    released = np.intersect1d(held_out, np.flatnonzero(phase == PHASES.index("release")))
    fit = Fit(
        history=history,
        identifiability=table,
        held_out={
            "unit": "m",
            "default": _number(before),
            "fitted": _number(after),
            "after_release_default": _number(observation.error(default.u, released)),
            "after_release_fitted": _number(observation.error(final.u, released)),
            "frames": held_out.tolist(),
            "field_kept": bool(refinement.kept) if refinement else False,
            "phases": [PHASES[k] for k in phase],
        },
        words=in_words(table, per_frame, before, after),
    )
    step = 1 / camera.fps / per_frame
    return Material(np.array(names), theta.astype(np.float32)), _physics(prepared, values, table, settings, step), fit


def _windows(motion: Motion, fitted: np.ndarray, share: float) -> list[int]:
    """Last frames of the rounds: each window twice the one before, the first not before the motion begins."""
    end = int(fitted[-1])
    speed = np.linalg.norm(np.diff(motion.position, axis=1), axis=-1).max(0) * motion.active[:, 1:].any(0)
    start = int(np.argmax(speed > 0.1 * speed.max())) + 3
    first = max(start, int(share * end), 2)
    windows = [end]
    while windows[0] // 2 >= first:
        windows.insert(0, int(fitted[np.searchsorted(fitted, windows[0] // 2)]))
    return windows


def _plain(wanted: Search, x: np.ndarray) -> list[float]:
    values = wanted.values(x)
    return [values[law][param] for law, param, _ in wanted.free]


def _number(value: float) -> float | None:
    """JSON has no NaN: a number that could not be had is null."""
    return value if np.isfinite(value) else None


def _physics(prepared: Prepared, values: Values, table: dict, settings: Estimation, step: float) -> Physics:
    terms = {}
    for law, term in choose(prepared.terms).items():
        terms[law] = {}
        for name, p in term.params.items():
            entry = {"value": values[law][name], "unit": p.unit}
            known = table.get(f"{law}.{name}")
            if known:
                entry |= {"low": known["low"], "high": known["high"], "identifiable": known["told"]}
            terms[law][name] = entry
    return Physics(
        terms=terms, density=settings.density, gravity=list(settings.gravity),
        grid={"spacing": prepared.simulator.grid.spacing, "step": step},
    )  # fmt: skip


def _unfitted(prepared: Prepared, wanted: Search, settings: Estimation, camera: Camera, why: str):
    values = wanted.values(wanted.start)
    names = columns(choose(prepared.terms))
    material = Material(np.array(names), prepared.theta(values).astype(np.float32))
    per_frame = prepared.per_frame(values, camera.fps, SAFETY)
    fit = Fit(history=[], identifiability={}, held_out={}, words=why)
    return material, _physics(prepared, values, {}, settings, 1 / camera.fps / per_frame), fit
