"""The whole estimation: support and start, rounds, a field where it pays, then what is known."""

from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.doubts import Doubts
from surgisim.artifacts.fit import Fit
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.masks import Masks
from surgisim.artifacts.material import Material
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.physics import Physics
from surgisim.artifacts.scene import Scene
from surgisim.artifacts.tracks import Tracks
from surgisim.config.estimation import Estimation
from surgisim.estimation.bearing import borne, handed_on
from surgisim.estimation.carrying import OPENS, carrying, course
from surgisim.estimation.damping import numerical_damping
from surgisim.estimation.doubts import doubts, none, spreads
from surgisim.estimation.finer import brought, finely, on_finer_grid
from surgisim.estimation.gauss_newton import Solution
from surgisim.estimation.hold import ask_hold
from surgisim.estimation.identify import identifiability, in_words
from surgisim.estimation.lay import Laying, upright
from surgisim.estimation.light_along_tracks import brightness, spoilt
from surgisim.estimation.model_error import model_error
from surgisim.estimation.observation import PHASES, fitted_frames, observe, phases
from surgisim.estimation.otherwise import (
    Otherwise,
    answers,
    better,
    decay,
    on_no_grid,
    otherwise,
    resolution,
    rivals,
    shares,
)
from surgisim.estimation.picture import picture_loss
from surgisim.estimation.pieces import seen_piece
from surgisim.estimation.refine import Refined, refine
from surgisim.estimation.rim import seen_rim
from surgisim.estimation.rounds import (
    INDEPENDENT,
    at_ease,
    choose_support,
    descend,
    lowest,
    number,
    settle_pull,
    windows,
)  # fmt: skip
from surgisim.estimation.search import PACE, search
from surgisim.estimation.starts import choose_starts
from surgisim.estimation.stated import by_phase
from surgisim.estimation.support import EDGES, Support, open_depth
from surgisim.estimation.trial import SAFETY, WORKERS, Trial, workers
from surgisim.estimation.written import physics_of, unfitted
from surgisim.mpm.grip import Drive
from surgisim.mpm.setup import SKIN, Prepared, Values, prepare
from surgisim.mpm.simulator import Run
from surgisim.physics.catalogue import choose, columns
from surgisim.physics.place import Place
from surgisim.problem import Problem

Say = Callable[[float, float, str], None]

FLOOR = 0.01
"""Least standard deviation of a tracked displacement, as a share of the grid's spacing."""
GUESSED = 1.4
"""How many times farther off numbers are than their intervals say where the surface was guessed from one view: what is
wrong of it bends them, and valleys far from the truth fit as well. Measured on 75 clips of families 31415 and 27182, of
which 74 to 95 % of the intervals held (docs/benchmarks/coverage.md)."""
STILL = 0.5
"""Motion below which a track is taken to stand still [px]."""


class Estimate(NamedTuple):
    """What the estimation hands on."""

    material: Material
    physics: Physics
    fit: Fit
    motion: Motion
    """How the instruments carry the tissue, as fitted."""
    body: Body
    """The body as it was laid for that."""
    doubts: Doubts
    """How tracked points would go were what is open beside the laws otherwise."""


def estimate(
    body: Body,
    scene: Scene,
    tracks: Tracks,
    motion: Motion,
    frames: Frames,
    masks: Masks,
    camera: Camera,
    settings: Estimation,
    progress: Say,
) -> Estimate:
    """What one clip tells of its tissue.

    Without a grip, or without motion, nothing drives the body and nothing can be learned: the
    parameters stay at their start values, and the fit says so.
    """
    if settings.form == "updated" and settings.field_iterations:
        raise Problem(
            "config key 'estimation.form' is 'updated', which has no adjoint, but 'estimation.field_iterations' is "
            f"{settings.field_iterations}. Set field_iterations to 0, or form to 'total'."
        )
    for law in settings.places:
        if law not in settings.terms:
            raise Problem(
                f"config key 'estimation.places' names '{law}', but the body's laws are {list(settings.terms)}. "
                "Add it to estimation.terms, or leave its place away."
            )
    places = {law: Place(p.center, p.extent, p.normal) for law, p in settings.places.items()}
    wanted = search(settings.terms, settings.start, settings.fixed)
    tracked = tracks.xyz[:, 0][np.isfinite(tracks.xyz[:, 0]).all(1)]
    carried = np.concatenate([scene.mean, tracked]).astype(float)

    def make(
        body: Body, motion: Motion, terms: tuple[str, ...] = tuple(settings.terms), carried: np.ndarray = carried,
        threads: int = 1,
    ) -> Prepared:  # fmt: skip
        return prepare(
            body, terms, density=settings.density, gravity=settings.gravity, carried=carried, threads=threads,
            device=settings.device, form=settings.form, places=places, grips=motion, skin=SKIN,
        )  # fmt: skip

    reason = _nothing_to_learn(motion, tracks, body)
    if reason:
        return Estimate(*unfitted(make(body, motion), wanted, settings, camera, reason), motion, body, none(tracks))
    bodies = [make(body, motion) for _ in range(workers(settings.device))]
    observation = observe(tracks, motion, camera, bodies[0].simulator, floor=FLOOR * body.spacing)
    total = len(frames.rgb)
    fitted = fitted_frames(frames.split)
    held_out = np.setdiff1d(np.arange(1, total), fitted)
    phase = phases(motion, total)
    trial = Trial(bodies, wanted, motion, observation, body.held, camera.fps, total, fitted, firm=False)
    if settings.enabled:
        trial = _opened(trial, body, tracks, camera, settings, make)
        trial = at_ease(_lit(trial, body, tracks, frames, masks, settings))
    parts = {
        "held_out": held_out,
        "after_release": np.intersect1d(held_out, np.flatnonzero(phase == PHASES.index("release"))),
        "fitted_frames": fitted,
    }
    x, history, table = trial.wanted.start, [], {}
    progress = _onward(progress)
    trial, run = borne(trial, x, history)
    default, edges = trial.stand(x)[0].observation, [trial]
    if trial.laying:
        edges, x = choose_support(trial, phase, history, progress)
        edges = [borne(one, x, history)[0] for one in edges]
        trial = edges[0]
    searched = settings.enabled and bool(wanted.free)
    if searched:
        begun = x
        trial, x, _ = settle_pull(edges, begun, phase, history, progress)
        rim = seen_rim(tracks, motion, camera, body.spacing) if settings.seen_rim and trial.laying else None
        piece = seen_piece(trial.laying.columns, tracks, motion) if settings.pieces and trial.laying else None
        trial, x = ask_hold(trial, x, begun, rim, piece, phase, history, progress)
        default = replace(default, weight=np.where(trial.observation.weight > 0, default.weight, 0.0))
    before = {name: default.error(run.u, at) for name, at in parts.items()}
    before_each = default.each(run.u, held_out)
    if searched:
        starts = choose_starts(trial, x, history, progress)
        ends = windows(fitted, phase, settings.first_window)
        trial, solution = lowest(trial, starts, ends, settings, history, progress)
        model: dict[str, np.ndarray] = {}
        open_beside: list[Otherwise] = []
        if trial.laying:
            ask = partial(otherwise, camera=camera, points=carried, make=make)
            trial, solution, model, open_beside = _weighed(trial, solution, ask, ends[-1:], settings, history, progress)
        table = _known(trial, solution, model, phase, settings)
        wide, wider = trial, solution
        if trial.laying and any(q["told"] for q in table.values()):
            fine, finest = finely(trial, solution, history, _part(progress, 0.7, 0.8))
            shift = finest.x - wider.x
            model = model | {"grid": np.outer(shift, shift)}
            # What nothing tells the pace of has no waves that ask for it: it tells how far a grid is off, and no more.
            if trial.eased is None:
                trial, solution = fine, finest
            table = _known(trial, solution, model, phase, settings)
        finer = trial is not wide
        # What fits may yet turn the tissue inside out in the frames after those that were compared.
        wide, _ = borne(wide, wider.x, history)
        unsure = doubts(wide, wider.x, spreads(wide.wanted, table), open_beside, tracks, camera)
        x, wide_x = solution.x, wider.x
    else:
        wide, wide_x, finer = trial, x, False
        unsure = none(tracks)
    edge = (trial.laying.margin, trial.laying.rim) if trial.laying else (0.0, bool(body.held[body.surface].any()))
    loose = trial.laying.loose if trial.laying else 0.0

    def alone(trial: Trial) -> Trial:
        """With one body, of which every thread simulates a share."""
        return replace(trial, bodies=[make(trial.bodies[0].body, trial.motion, threads=WORKERS)])

    coarse, uniform = alone(wide.settled(wide_x)), wide.values(wide_x)
    field, refined = coarse.theta(uniform), None
    if settings.enabled:
        coarse, _ = handed_on(coarse, uniform, field, history)
        # A field shapes what is slow, which the wider grid shows as well, at a fifth of the cost.
        field, refined = _refined(coarse, uniform, wide.eased or 0.0, scene, frames, masks, camera, settings, progress)
    on_finer = None
    if finer:
        on_finer = on_finer_grid(alone(trial.settled(x)), trial.wanted.values(x), coarse, uniform, field, history)
        if on_finer is None:
            trial, x = wide, wide_x
            table = _known(trial, wider, model, phase, settings)
    depth, values = trial.depth(x), trial.wanted.values(x)
    if on_finer:
        trial, theta, run = on_finer
    else:
        trial, theta = coarse, brought(field, coarse, uniform, coarse, values)
        # What nothing tells the pace of takes the same shapes in longer steps.
        there = trial.wanted.values(trial.wanted.paced(x, wide.eased or 0.0))
        trial, run = handed_on(trial, there, brought(theta, trial, values, trial, there), history)
    prepared, laid = trial.bodies[0], trial.bodies[0].body
    support = Support(depth, *edge, len(trial.motion.rim), loose, bool(len(laid.torn)))
    path = trial.drive(values, stiffest=prepared.stiffest(theta))
    after = {name: trial.observation.error(run.u, at) for name, at in parts.items()}
    after_each = trial.observation.each(run.u, held_out)
    apart = f"held-out track error {after['held_out'] * 1e3:.3f} mm"
    progress(1.0, 1.0, f"{apart} ({before['held_out'] * 1e3:.3f} mm with default parameters)")
    if refined:
        history += [{"round": "field", **h} for h in refined.history]
    damping = None
    if settings.form == "total":
        damping = numerical_damping(laid, settings.density, values, trial.held, path.step, settings.device)
    fit = Fit(
        history=history,
        identifiability=table,
        held_out={
            "unit": "m",
            "default": number(before["held_out"]),
            "fitted": number(after["held_out"]),
            "after_release_default": number(before["after_release"]),
            "after_release_fitted": number(after["after_release"]),
            "used_default": number(before["fitted_frames"]),
            "used_fitted": number(after["fitted_frames"]),
            "by_phase": by_phase(before_each, after_each, phase[held_out]),
            "frames": held_out.tolist(),
            "points": int(observation.moving.sum()),
            "field_kept": bool(refined.kept) if refined else False,
            "grip": trial.grip,
            "support": asdict(support),
            "phases": [PHASES[k] for k in phase],
        },
        words=in_words(table, support, trial.grip, path.per_frame, before["held_out"], after["held_out"], damping),
        numerical_damping=damping,
    )
    names = np.array(columns(choose(prepared.terms)))
    material = Material(names, theta.astype(np.float32), trial.held)
    physics = physics_of(prepared, values, table, settings, path.step, trial.grip)
    return Estimate(material, physics, fit, trial.motion, laid, unsure)


def _opened(
    trial: Trial, body: Body, tracks: Tracks, camera: Camera, settings: Estimation,
    make: Callable[[Body, Motion], Prepared],
) -> Trial:  # fmt: skip
    """The trial with what else a clip leaves open beside the laws."""
    wanted, motion = trial.wanted, trial.motion
    if settings.carrying:
        measured = bool((trial.observation.weight[..., 2] > 0).any())
        wanted = replace(wanted, carrying=carrying(motion, tracks, camera, measured))
    free = phases(motion, trial.frames) == PHASES.index("release")
    trial = replace(
        trial, error=model_error(trial.observation, course(tracks, motion), free, INDEPENDENT, settings.carrying)
    )
    laid = upright(body, camera) if settings.support and settings.form == "total" else None
    if laid is None:
        return replace(trial, wanted=wanted)
    depth = open_depth(laid)
    laying = Laying(laid, EDGES[0].margin(depth, laid.spacing), EDGES[0].rim, trial.observation, make)
    return replace(trial, wanted=replace(wanted, depth=depth), laying=laying)


def _lit(trial: Trial, body: Body, tracks: Tracks, frames: Frames, masks: Masks, settings: Estimation) -> Trial:
    """The trial with the light of its points, where enough of them can be seen to stand still and to move."""
    if not settings.brightness:
        return trial
    rest, motion = tracks.xyz[:, 0].astype(float), trial.motion
    free = np.isfinite(rest).all(1) & tracks.visible[:, 0]
    for center, radius in zip(motion.center_rest, motion.radius, strict=True):
        free &= np.linalg.norm(rest - center, axis=1) > radius
    used = np.isin(np.arange(trial.frames), [0, *trial.fitted])
    light = brightness(
        frames.rgb, spoilt(masks), rest[free], tracks.xy[free].astype(float), tracks.visible[free] & used,
        course(tracks, motion), trial.bodies[0].simulator, step=0.5 * body.spacing, independent=INDEPENDENT,
    )  # fmt: skip
    observation = replace(trial.observation, light=light)
    laying = replace(trial.laying, observation=observation) if trial.laying else None
    return replace(trial, observation=observation, laying=laying)


def _weighed(
    trial: Trial,
    solution: Solution,
    ask: Callable[[Trial, np.ndarray], Iterator[Otherwise]],
    ends: list[int],
    settings: Estimation,
    history: list,
    progress: Say,
) -> tuple[Trial, Solution, dict[str, np.ndarray], list[Otherwise]]:
    """The fit held against its rivals, going on from a far more probable one, and against what it takes for granted.

    With it the covariance that each adds to the numbers in search space, by its name, and what was taken for granted.
    """
    first, wanted = trial, trial.wanted
    found = answers(solution, list(rivals(trial, solution.x)), _part(progress, 0.55, 0.63), trial.regions)
    chosen = better(solution, wanted, found, trial.regions)
    if chosen:
        begun = replace(found[0], one=Otherwise("as first found", first, rival=True), x=solution.x)
        found = [a for a in found[1:] if a is not chosen] + [begun] * (chosen is not found[0])
        # It was followed to where it is nearly lowest; what it takes for granted is asked from a derivative of its own.
        once = settings.model_copy(update={"iterations": 1})
        trial, solution = descend(chosen.one.trial, chosen.x, ends, once, history, progress, jacobian=chosen.jacobian)
    else:
        found = found[1:]
    ask_here = list(ask(trial, solution.x))
    here, *others = answers(solution, ask_here, _part(progress, 0.63, 0.7), trial.regions)
    if here.residual is not None:
        solution = Solution(here.x, here.residual, solution.jacobian)
    found += others
    table = list(zip(found, shares(solution, wanted, found, trial.regions), strict=True))
    for a, share in table:
        history.append({"round": "otherwise", "about": a.one.about, "share": share, "misfit": number(a.cost)})
    shifts = {a.one.about: (a.x - solution.x, share) for a, share in table}
    taken = [a.one for a in others if not a.one.rival]
    return trial, solution, {about: share * np.outer(d, d) for about, (d, share) in shifts.items()}, taken


def _known(trial: Trial, solution: Solution, model: dict, phase: np.ndarray, settings: Estimation) -> dict:
    """What a solution tells of the tissue itself: what its grid gets wrong is taken off, and counts as not known."""
    x, measured = solution.x, (trial.observation.weight[..., 2] > 0).any()
    model = model | {"how jaws open": np.diag((OPENS * trial.wanted.opens) ** 2)}
    if trial.laying:
        off, doubt = on_no_grid(trial, x)
        model = model | {
            "periods on the grid": doubt,
            "particles": resolution(trial, x),
            "decay on the grid": decay(trial, x),
        }
        x = np.clip(x + off, *trial.wanted.bounds)
    return identifiability(
        replace(solution, x=x), trial.wanted, phase_of=trial.of_frames(phase), phase_names=PHASES,
        density=settings.density, length=trial.depth(x), independent=INDEPENDENT, region=trial.regions, model=model,
        wider=1.0 if measured else GUESSED,
    )  # fmt: skip


def _part(progress: Say, begin: float, end: float) -> Say:
    """Progress of a piece of the whole."""
    return lambda done, of, text: progress(begin + (end - begin) * done / of, 1.0, text)


def _onward(progress: Say) -> Say:
    """The same, never backwards."""
    farthest = 0.0

    def say(done: float, of: float, text: str) -> None:
        nonlocal farthest
        farthest = max(farthest, done / of)
        progress(farthest, 1.0, text)

    return say


def _nothing_to_learn(motion: Motion, tracks: Tracks, body: Body) -> str:
    """Why nothing drives the body, or an empty string."""
    moved = np.where(tracks.visible, np.linalg.norm(tracks.xy - tracks.xy[:, :1], axis=-1), 0.0)
    if moved.size and np.percentile(moved.max(1), 99) < STILL:
        return (
            "Nothing moves in this clip, so there is no motion to learn its physics from; the scene is reconstructed "
            "all the same, and a simulation of it runs with default parameters."
        )
    if not len(motion.radius):
        return (
            "No instrument was found that holds tissue: nothing drives the body, so its physics cannot be learned from "
            "this clip. If one does, say where: --grasp X,Y,RADIUS,START,END, in the recording's pixels and seconds; "
            "tracking's log has the likeliest."
        )
    if np.linalg.norm(motion.position - motion.position[:, :1], axis=-1).max() < 0.05 * body.spacing:
        return "The grip hardly moves: there is no motion to learn the physics from."
    return ""


def _refined(
    trial: Trial,
    values: Values,
    eased: float,
    scene: Scene,
    frames: Frames,
    masks: Masks,
    camera: Camera,
    settings: Estimation,
    progress: Say,
) -> tuple[np.ndarray, Refined | None]:
    """Per-particle parameters where they pay, else the uniform ones; eased: as the trial that `values` are of."""
    prepared, fitted = trial.bodies[0], trial.fitted
    theta, names = trial.theta(values), columns(choose(prepared.terms))
    chosen = [names.index(n) for n in settings.field if n in names and n in trial.wanted.names]
    if not settings.field_iterations or not chosen:
        return theta, None
    judge = fitted[2::4]
    train = np.setdiff1d(fitted, judge)
    shown = np.sort(np.random.default_rng(settings.seed).permutation(train)[: settings.image_frames])
    image = None
    if settings.image_weight > 0 and len(shown):
        seen = masks.tissue & ~masks.specular
        image = picture_loss(scene, camera, frames.rgb, seen, prepared.simulator, shown)
    ends = [p for t in choose(prepared.terms).values() for p in t.params.values()]
    # What is simulated at another pace has its limits there as well.
    slower = np.exp([PACE.get(p.unit, 0.0) * eased for p in ends])

    def simulated(theta: np.ndarray) -> tuple[Drive, Run]:
        rows, frames = prepared.stiffest(theta), int(fitted[-1]) + 1

        def at(stride: float) -> tuple[Drive, Run]:
            path = trial.drive(values, frames=frames, stiffest=rows, safety=SAFETY * stride)
            return path, prepared.simulator.run(theta, path)

        return trial.strided(at)

    refined = refine(
        prepared.simulator, simulated, theta, chosen, trial.observation, train=train, judge=judge, image=image,
        image_weight=settings.image_weight, iterations=settings.field_iterations, smoothness=settings.smoothness,
        limits=(slower * [p.low for p in ends], slower * [p.high for p in ends]),
        progress=lambda done, of, text: progress(0.8 + 0.15 * done / of, 1.0, text),
    )  # fmt: skip
    return refined.theta, refined
