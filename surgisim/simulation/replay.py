"""Run the recorded manipulation, or a new one, on a fitted body."""

from collections.abc import Callable
from functools import partial

import numpy as np

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.masks import Masks
from surgisim.artifacts.material import Material
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.physics import Physics
from surgisim.artifacts.replay import Replay
from surgisim.artifacts.scene import Scene
from surgisim.baselines.run import run as baseline
from surgisim.config.simulation import Simulation
from surgisim.gaussians.rim import beyond
from surgisim.mpm.carried import Carried
from surgisim.mpm.grip import Drive
from surgisim.mpm.setup import Prepared, checked_per_frame, theta_of, values_of
from surgisim.mpm.simulator import Run, Simulator
from surgisim.physics.catalogue import choose, defaults
from surgisim.problem import Problem
from surgisim.side_by_side import in_order
from surgisim.simulation.draw import Drawn
from surgisim.simulation.operation import Plan, plan
from surgisim.simulation.relight import Light, find_light
from surgisim.simulation.setup import bodies, boundary, held_at_rim, recorded_task


def replay(
    body: Body,
    scene: Scene,
    material: Material,
    physics: Physics,
    motion: Motion,
    camera: Camera,
    settings: Simulation,
    progress: Callable[[float, float, str], None],
    *,
    recording: tuple[Frames, Masks] | None = None,
) -> Replay:
    """The body at every frame of the recorded motion, or of `settings.operation`.

    recording: what the lamp is learned from; without it, colours stay as the rest frame has them.
    """
    if not np.isclose(physics.grid["spacing"], body.spacing, rtol=1e-4):
        raise Problem(
            f"physics.json was fitted on a grid of {physics.grid['spacing']:.6f} m, but body.npz is made for "
            f"{body.spacing:.6f} m. Fit again, or pass the body that was fitted."
        )
    theta = theta_of(physics, material)
    if len(theta) != len(body.rest):
        raise Problem(f"material.npz has {len(theta)} particles, but body.npz has {len(body.rest)}. Pass a pair.")
    task = (
        recorded_task(motion, camera)
        if settings.operation is None
        else held_at_rim(plan(settings.operation, body.rest, body.surface, camera, body.spacing), motion)
    )
    per_frame = checked_per_frame(physics, material, camera.fps) * settings.refine_step
    rim = beyond(scene, camera)
    parts = bodies(body, [scene, rim], physics, task, settings.device)
    whole, joules = parts[0].simulator, None

    def half(done: float, total: float, text: str) -> None:
        progress(0.5 * done, total, text)

    if settings.solver == "mpm":
        path = boundary(parts[0], task, physics, material, camera, per_frame)
        states = _march([p.simulator for p in parts], theta, path, task, half)
    else:
        run, joules = _baseline(parts, task, physics, material, camera, settings, half)
        states = {t: (whole, run, t) for t in range(len(run.u))}
    frames = len(states)
    light = None
    if recording is not None and settings.render and settings.relight:
        recorded = [run.u[k] for _, run, k in (states[t] for t in range(frames))]
        if settings.operation is not None:
            again = recorded_task(motion, camera)
            if settings.solver == "mpm":
                recorded = whole.run(theta, boundary(parts[0], again, physics, material, camera, per_frame)).u
            else:
                recorded = _baseline(parts, again, physics, material, camera, settings, half)[0].u

        splats = Drawn(scene, rim, body, whole, settings.interior, settings.device)

        def under(light: Light) -> Callable[[np.ndarray], np.ndarray]:
            return partial(splats.under(light), camera=camera)

        light = find_light(scene, camera, body.spacing, whole, recorded, *recording, under)
        progress(0.5, 1.0, f"lamp: {light.words}")
    looks = {
        id(s): _Look(s, body, (scene, rim), settings, physics, theta, light)
        for s in dict.fromkeys(simulator for simulator, _, _ in states.values())
    }

    def seen(t: int) -> tuple:
        simulator, run, k = states[t]
        look, u = looks[id(simulator)], run.u[k]
        nodes = simulator.displaced(u)[: simulator.grid.count].astype(np.float32)
        return *look.measure(u, run.v[k]), nodes, look.picture(u, camera) if settings.render else None

    position, nodes, smallest, energy, rgb = [], [], [], [], []
    for t, (moved, least, held, displaced, picture) in enumerate(in_order(seen, zip(range(frames)))):
        position.append(moved.astype(np.float32))
        nodes.append(displaced)
        smallest.append(least)
        energy.append(held if joules is None else joules[t])
        if settings.render:
            rgb.append(picture)
        progress(0.5 + 0.5 * (t + 1) / frames, 1.0, f"drawing frame {t + 1}/{frames}")
    grid = whole.grid
    picture = np.stack(rgb) if rgb else np.zeros((0, camera.height, camera.width, 3), np.uint8)
    return Replay(
        time=np.arange(frames) / camera.fps,
        position=np.stack(position),
        nodes=np.stack(nodes),
        origin=grid.origin,
        shape=grid.shape,
        spacing=grid.spacing,
        smallest_volume_ratio=np.array(smallest),
        energy=np.array(energy),
        rgb=picture,
    )


def _baseline(
    parts: list[Prepared],
    task: Plan,
    physics: Physics,
    material: Material,
    camera: Camera,
    settings: Simulation,
    progress: Callable[[float, float, str], None],
) -> tuple[Run, np.ndarray]:
    """A run of masses and springs, and its energies [J], (T, 2)."""
    if task.cut is not None:
        raise Problem(f"simulation: the solver '{settings.solver}' cannot cut. Take mpm, or leave the cut out.")
    return baseline(
        settings.solver,
        parts[0],
        values_of(physics),
        lambda per_frame: boundary(parts[0], task, physics, material, camera, per_frame),
        fps=camera.fps,
        refine=settings.refine_step,
        progress=progress,
    )


def _march(parts: list[Simulator], theta, path: Drive, task: Plan, progress):
    """For every frame: simulator, run, and the frame's place in it."""
    whole, last = parts[0], path.frames - 1
    switch = task.cut_frame if task.cut is not None else last
    states: dict[int, tuple[Simulator, Run, int]] = {}
    run = whole.run(theta, path, first=0, last=switch, progress=progress)
    states |= {t: (whole, run, t) for t in range(switch + 1)}
    if task.cut is not None and switch < last:
        opened = parts[1]
        begin = (*(opened.inherited(whole, a[-1]) for a in (run.u, run.v)), run.q[-1])
        run = opened.run(theta, path, begin=begin, first=switch, last=last, progress=progress)
        states |= {switch + k: (opened, run, k) for k in range(1, last - switch + 1)}
    return states


class _Look:
    """What is read off a state: particles, det F, energy, and the splats to draw."""

    def __init__(
        self,
        simulator: Simulator,
        body: Body,
        scenes: tuple[Scene, Scene],
        settings: Simulation,
        physics: Physics,
        theta: np.ndarray,
        light: Light | None,
    ) -> None:
        self.body, self.particles = body, Carried(body.rest, simulator)
        self.mass = simulator.mass.numpy()
        self.laws = []
        column = 0
        for term in choose(physics.terms).values():
            names = list(term.row(defaults(term)))
            values = {c: theta[:, column + k] for k, c in enumerate(names)}
            column += len(names)
            if term.energy:
                self.laws.append((term.energy, values))
        if settings.render:
            self.picture = Drawn(*scenes, body, simulator, settings.interior, settings.device).under(light)

    def measure(self, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, float, tuple[float, float]]:
        """Particle positions [m], (P, 3); smallest det F; kinetic and elastic energy [J]."""
        moved, F = self.particles.at(u)
        kinetic = 0.5 * float((self.mass * (v.astype(float) ** 2).sum(-1)).sum())
        elastic = sum(float((e(F, **values) * self.body.volume).sum()) for e, values in self.laws)
        return moved, float(np.linalg.det(F).min()), (kinetic, elastic)
