"""The optimisation of scene and field, a frame or a few at a time."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import torch
from torch.nn.functional import avg_pool2d

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.scene import Scene
from surgisim.config.reconstruction import Reconstruction
from surgisim.deformation.field import Field, still_field
from surgisim.gaussians.adam import Adam
from surgisim.gaussians.densify import ATTRIBUTES, Record, renew
from surgisim.gaussians.losses import anisotropic, followed, masked_l1, structure, trajectory
from surgisim.gaussians.neighbours import groups
from surgisim.gaussians.observations import Observations
from surgisim.gaussians.rasterise import Image, engine_on, rasterise
from surgisim.gaussians.schedule import Phase, phase_at, rate_at
from surgisim.gaussians.straight import off_midway, straightness
from surgisim.gaussians.tint import clock, knots, tint
from surgisim.problem import Problem

RENEWALS = (0.2, 0.4, 0.6, 0.8)
"""When Gaussians are dropped and split [fraction of the phases in which both scene and field move]."""
SPLIT = 0.1
"""Largest share of the Gaussians split at once."""
WIDEST = 10.0
"""Largest radius kept [median first radius]."""
SMALLEST_UNIT = 2.0
"""What r_m is counted in at least [median first radius]: a scene of few Gaussians still has to be closed."""
TRAJECTORY_EVERY = 2
"""Iterations from one to the next that counts the trajectory term, as many times over: it looks at six times as many
points as there are."""
SMOOTHED_EVERY = 4
"""Iterations from one to the next that counts how rough the field is, as many times over."""
WEIGHED_EVERY = 2
"""Iterations from one to the next that tells a GPU's engine what each Gaussian adds to the picture, for which it draws
that once more."""
MIDWAY_EVERY = 8
"""Iterations from one to the next that looks at a frame of which nothing is seen."""
BOX_PERCENTILES = 0.5, 99.5
"""Percentiles of the centres between which the scene's box lies [%]."""
REPORTS = 100
"""Rows of the history."""

Say = Callable[[float, float, str], None]


class Fit:
    """The state of the optimisation."""

    def __init__(self, start: Scene, seen: Observations, camera: Camera, length: int, settings: Reconstruction) -> None:
        self.device = torch.device(settings.device)
        self.seen, self.camera, self.settings = seen.on(self.device), camera, settings
        self.rng = np.random.default_rng(settings.seed)
        self.moments = seen.frame / camera.fps
        self.unseen = np.setdiff1d(np.arange(seen.frame[-1]), seen.frame)
        self.straight = straightness(seen.frame, self.unseen, self.seen.went, self.seen.sure)
        self.field = first_field(start.mean, camera, length, settings, self.rng).on(self.device)
        self.radius = float(np.exp(np.median(start.scale)))
        side = np.ptp(np.percentile(start.mean, BOX_PERCENTILES, axis=0), axis=0).max()
        self.unit = max(settings.anisotropy_unit * side, SMALLEST_UNIT * self.radius)
        self.most = min(settings.most_gaussians, int(settings.growth * len(start.mean)))
        self.middle = float(np.median(start.mean[:, 2]))
        self.head = [f"head_{i}" for i in range(len(self.field.head))]
        tensors = {name: torch.from_numpy(getattr(start, name)).to(self.device) for name in ATTRIBUTES}
        self.tints = [
            [f"tint_{scale}_{k}" for k in range(knots(often, len(seen.frame)))]
            for scale, often in enumerate(settings.knots_of_tint)
        ]
        self.tint = [name for names in self.tints for name in names]
        tensors |= {"planes": self.field.planes} | dict(zip(self.head, self.field.head, strict=True))
        tensors |= {name: torch.zeros_like(tensors["color"]) for name in self.tint}
        rates = {name: getattr(settings, f"rate_{name}") for name in (*ATTRIBUTES, "planes")}
        rates |= dict.fromkeys(self.head, settings.rate_head) | dict.fromkeys(self.tint, settings.rate_tint)
        self.adam = Adam(tensors, rates | {"mean": settings.rate_mean * self.field.reach})
        self.groups: torch.Tensor | None = None
        self.record = Record.empty(len(start.mean), self.device)
        self.order: list[int] = []

    def run(self, progress: Say) -> np.ndarray:
        """All iterations; returns the history, (R, 5)."""
        total = self.settings.iterations
        renewals = {round(share * self.settings.phases[1] * total) for share in RENEWALS}
        every = max(total // REPORTS, 1)
        history, rows, steps = [], [], []
        for i in range(total):
            phase = phase_at(i, total, self.settings.phases)
            if i in renewals:
                self.renew()
            frames = self.next_frames(phase, i)
            steps.append((i, frames, self.step(phase, frames, i)))
            reports = (i + 1) % every == 0 or i == total - 1
            # A GPU that is asked after every step waits for each.
            if reports or self.device.type == "cpu":
                rows += self.finite(steps)
                steps = []
            if reports:
                loss, error = np.mean(rows, 0)
                psnr = -10 * np.log10(max(error, 1e-12))
                count = len(self.adam.tensors["mean"])
                history.append((i + 1, loss, psnr, count, phase.number))
                progress(i + 1, total, f"{phase.name}: {psnr:.1f} dB, {count} Gaussians")
                rows = []
        return np.array(history, np.float32)

    def next_frames(self, phase: Phase, iteration: int) -> list[int]:
        """Which of the seen frames an iteration looks at."""
        # Frame 0 is the rest scene: seen no oftener than others, the scene would settle where it is on average.
        often = self.settings.rest_every if phase.moves_canonical else 0
        frames = [0] if often and iteration % often == 0 else []
        while len(frames) < self.settings.frames_per_step:
            if not self.order:
                self.order = self.rng.permutation(len(self.seen.frame)).tolist()
            frames.append(self.order.pop())
        return frames

    def finite(self, steps: list[tuple[int, list[int], torch.Tensor]]) -> list[list[float]]:
        """What `step` gave at each iteration for these frames, as numbers; raises Problem for the first that is
        none."""
        values = torch.stack([value for *_, value in steps]).tolist()
        for (iteration, frames, _), (loss, _) in zip(steps, values, strict=True):
            if not np.isfinite(loss):
                named = ", ".join(str(self.seen.frame[u]) for u in frames)
                raise Problem(
                    f"reconstruction: the loss is not finite at iteration {iteration}, frame {named}. "
                    "Lower the step sizes (rate_mean, rate_planes, rate_head)."
                )
        return values

    def step(self, phase: Phase, frames: Sequence[int], iteration: int) -> torch.Tensor:
        """The loss in these of the seen frames, its gradients, one step; the loss and the mean squared error on seen
        tissue, (2,)."""
        adam = self.adam
        canonical = ATTRIBUTES if phase.moves_canonical else ()
        shown = self.tint if phase.recolours else ()
        adam.watch((*canonical, *shown, "planes", *self.head) if phase.moves_field else (*canonical, *shown))
        times = [self.seen.frame[u] / self.camera.fps for u in frames]
        field = self.current_field()
        mean, color = adam.tensors["mean"], adam.tensors["color"]
        # A frozen field carries on what moves by little; what it would say of its own slope is left out.
        with torch.set_grad_enabled(phase.moves_field):
            carried, *others = field.at(mean, [*times, *self.earlier(phase, times, iteration)])
        moved, opacity, turn, grow = (change[: len(times)] for change in (carried, *others))
        added = self.added([clock(time, self.moments) for time in times]) if shown else torch.zeros_like(moved)
        radius = (adam.tensors["scale"] + grow).exp()
        recorded = iteration < RENEWALS[-1] * self.settings.phases[1] * self.settings.iterations
        on_cpu = self.device.type == "cpu"
        probe = torch.zeros(*moved.shape[:2], 2, device=self.device, requires_grad=recorded)
        image = rasterise(
            mean + moved,
            adam.tensors["rotation"] + turn,
            radius,
            torch.sigmoid(adam.tensors["opacity"] + opacity),
            color + added,
            self.camera,
            engine=engine_on(self.device),
            probe=probe,
            weigh=recorded and (on_cpu or iteration % WEIGHED_EVERY == 0),
            checked=on_cpu,
        )
        seen = self.seen.of(frames)
        loss = self.misfit(phase, image, seen) + self.priors(phase, field, radius, carried, seen, iteration)
        if shown and self.settings.tint:
            loss = loss + self.settings.tint * added.abs().mean()
        # Frame 0 says nothing of the field.
        if loss.requires_grad:
            loss.backward()
        if phase.moves_field and not any(times):
            # The rest scene says nothing of the head: its slope is zero, and its moments decay as ever.
            for name in self.head:
                adam.tensors[name].grad = torch.zeros_like(adam.tensors[name])
        adam.advance(rate_at(iteration, self.settings.iterations, self.settings.rate_end))
        if canonical:
            self.bound()
        if recorded:
            self.record.add(probe.grad, image.weight)
        whole = seen.weight == 1
        wrong = (image.rgb.detach() - seen.rgb).square().mean(-1)
        error = (wrong * whole).sum() / whole.sum().clamp(min=1)
        return torch.stack([loss.detach(), error])

    def added(self, gone: Sequence[float]) -> torch.Tensor:
        """What is added to the colours at B moments, sRGB 0-1, (B, G, 3); 0 at the first."""
        return tint([[self.adam.tensors[name] for name in names] for names in self.tints], gone)

    def misfit(self, phase: Phase, image: Image, seen: Observations) -> torch.Tensor:
        """Colour and depth of some frames against what was seen."""
        settings = self.settings
        weight = seen.weight if phase.recolours else seen.texture
        wrong = (image.rgb - seen.rgb) * weight[..., None]
        color = masked_l1(image.rgb, seen.rgb, weight)
        if not phase.moves_field and settings.structure:
            color = color + settings.structure * structure(image.rgb, seen.rgb, weight)
        if settings.squared:
            color = color + settings.squared * (wrong * (image.rgb - seen.rgb)).sum() / (3 * weight.sum()).clamp(min=1)
        if phase.number == 1 and settings.pooled:
            for share in settings.pooled_sizes:
                block = max(round(share * max(seen.z.shape[1:])), 1)
                blurred = avg_pool2d(wrong.permute(0, 3, 1, 2), block, max(block // 2, 1))
                color = color + settings.pooled * blurred.abs().mean()
        # sum w (z_i - z), so that a surface that is not yet opaque is not pushed away to make up for it.
        depth = masked_l1(image.depth / self.middle, seen.z / self.middle * image.alpha, seen.trust)
        return color + settings.depth * depth

    def keeps_together(self, phase: Phase, iteration: int) -> bool:
        """Whether the trajectory term counts in this iteration."""
        return phase.trajectory and self.settings.trajectory > 0 and iteration % TRAJECTORY_EVERY == 0

    def earlier(self, phase: Phase, times: Sequence[float], iteration: int) -> list[float]:
        """The moment [s] from which the trajectory term as printed measures, a frame before the last of `times` at
        which anything moves. One of several frames does for all."""
        asked = self.settings.trajectory_form == "literal" and self.keeps_together(phase, iteration)
        return [t - 1 / self.camera.fps for t in times if t > 0][-1:] if asked else []

    def priors(
        self,
        phase: Phase,
        field: Field,
        radius: torch.Tensor,
        carried: torch.Tensor,
        seen: Observations,
        iteration: int,
    ) -> torch.Tensor:
        """What is asked of scene and field besides the picture; carried: dmu in the B frames seen [m], (B, G, 3), and
        then at the moment `earlier` than one of them, if there is one."""
        settings, times = self.settings, seen.frame / self.camera.fps
        moved, before = carried[: len(times)], carried[len(times) :]
        total = radius.new_zeros(())
        if settings.anisotropy:
            limits = {"r_m": settings.anisotropy_largest, "r_ani": settings.anisotropy_ratio}
            total = total + settings.anisotropy * anisotropic(radius.flatten(0, 1), unit=self.unit, **limits)
        if phase.moves_field and iteration % SMOOTHED_EVERY == 0:
            space, rough = field.roughness()
            smoothness = settings.smoothness_space * space + settings.smoothness_time * rough
            total = total + SMOOTHED_EVERY * smoothness
        if not times.any():
            return total
        if self.keeps_together(phase, iteration):
            if self.groups is None:
                points = self.adam.tensors["mean"].detach().cpu().numpy()
                self.groups = torch.from_numpy(groups(points, settings.neighbours)).to(self.device)
            gone, literal = moved[np.flatnonzero(times)[-1]], settings.trajectory_form == "literal"
            motion = (gone - before[0] if literal else gone) / self.radius
            total = total + TRAJECTORY_EVERY * settings.trajectory * trajectory(motion, self.groups, literal=literal)
        if phase.moves_field and settings.correspondence:
            total = total + settings.correspondence * self.astray(moved, seen)
        if phase.moves_field and settings.midway and len(self.unseen) and iteration % MIDWAY_EVERY == 0:
            total = total + MIDWAY_EVERY * settings.midway * self.off_midway(field, iteration // MIDWAY_EVERY)
        return total

    def off_midway(self, field: Field, turn: int) -> torch.Tensor:
        """How far Gaussians are, in a frame that is not looked at, from half way between those beside it; such frames
        take turns."""
        k = turn % len(self.unseen)
        time = self.unseen[k] / self.camera.fps
        after = int(np.searchsorted(self.moments, time))
        mean = self.adam.tensors["mean"].detach()
        row, column, _ = self.rest_pixels(mean)
        moments = self.moments[after - 1], time, self.moments[after]
        return off_midway(field, mean, moments, self.straight[k, row, column].float(), self.radius)

    @torch.no_grad()
    def bound(self) -> None:
        """Splats of the canonical scene have colours that are some, and are no larger or thinner than what the
        anisotropic term asks for on average."""
        # Viewers show a splat that is brighter than white as a dark speck.
        self.adam.tensors["color"].clamp_(0, 1)
        if self.settings.anisotropy:
            scale = self.adam.tensors["scale"]
            scale.clamp_(max=math.log(self.settings.anisotropy_largest * self.unit))
            scale.clamp_(min=scale.amax(1, keepdim=True) - math.log(self.settings.anisotropy_ratio))

    def astray(self, moved: torch.Tensor, seen: Observations) -> torch.Tensor:
        """How far the field carries Gaussians past where the surface was seen to go; the scene at rest stays."""
        rest = self.adam.tensors["mean"].detach()
        row, column, inside = self.rest_pixels(rest)
        went, sure = seen.went[:, row, column].float(), seen.sure[:, row, column].float() * inside
        start = pixels(rest, self.camera)
        gone = pixels(rest + moved, self.camera) - start
        return followed(gone.flatten(0, 1), went.flatten(0, 1), sure.flatten(), unit=0.01 * max(seen.sure.shape[1:]))

    def rest_pixels(self, rest: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Row and column of frame 0's pixel nearest to each Gaussian, (G,) each, and whether it lies in the frame."""
        height, width = self.seen.sure.shape[1:]
        column, row = pixels(rest, self.camera).round().long().unbind(1)
        inside = (column >= 0) & (row >= 0) & (column < width) & (row < height)
        return row.clamp(0, height - 1), column.clamp(0, width - 1), inside

    def renew(self) -> None:
        """Drop and split Gaussians."""
        renew(self.adam, self.record, self.most, SPLIT, WIDEST * self.radius, beside=self.tint)
        self.record = Record.empty(len(self.adam.tensors["mean"]), self.device)
        self.groups = None

    def current_field(self) -> Field:
        """The field with the weights as they are now."""
        head = tuple(self.adam.tensors[name] for name in self.head)
        return replace(self.field, planes=self.adam.tensors["planes"], head=head)

    def result(self) -> tuple[Scene, Field, np.ndarray]:
        """The canonical scene, the field, and what is added to the colours at each knot, (K, G, 3), on the CPU."""
        self.adam.watch(())
        arrays = {name: self.adam.tensors[name].cpu().numpy().copy() for name in ATTRIBUTES}
        arrays["rotation"] /= np.linalg.norm(arrays["rotation"], axis=1, keepdims=True)
        # All scales together are straight between frames that are looked at, or nearly so.
        count = max(len(self.moments) - 1, 1)
        at_knots = np.concatenate([self.added([(k + 1) / count]).cpu().numpy() for k in range(count)])
        return Scene(**arrays), self.current_field().on(torch.device("cpu")), at_knots


def pixels(points: torch.Tensor, camera: Camera) -> torch.Tensor:
    """Pixels of points, camera frame [m], (..., 3) -> [px], (..., 2)."""
    x, y, z = points.unbind(-1)
    return torch.stack([camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy], -1)


def first_field(
    mean: np.ndarray, camera: Camera, length: int, settings: Reconstruction, rng: np.random.Generator
) -> Field:
    """A still field over the scene's box and the clip's time; outliers lie outside the box and read its border."""
    low, high = np.percentile(mean, BOX_PERCENTILES, axis=0).astype(float)
    room = 0.02 * (high - low) + 1e-3 * np.max(high - low)
    low, high = low - room, high + room
    share = (high - low) / np.max(high - low)
    scales = settings.knots, settings.knots_in_depth, settings.knots_in_time
    if len({len(s) for s in scales}) != 1:
        raise Problem(
            f"reconstruction: knots {list(scales[0])}, knots_in_depth {list(scales[1])} and knots_in_time "
            f"{list(scales[2])} must have one number a scale each."
        )
    sizes = [
        [max(2, round(n * share[0])), max(2, round(n * share[1])), max(2, deep), max(2, round(often * length))]
        for n, deep, often in zip(*scales, strict=True)
    ]
    duration = max(length - 1, 1) / camera.fps
    corners = np.append(low, 0.0), np.append(high, duration)
    width, cubic = settings.head_width, settings.cubic_in_time
    return still_field(*corners, np.array(sizes), settings.channels, width, rng, cubic=cubic)
