"""Settings of the canonical scene and its deformation field."""

from typing import Annotated, Literal

from pydantic import Field

from surgisim.config.base import Settings


class Reconstruction(Settings):
    iterations: int = Field(3000, ge=10)
    """Optimisation steps [1]."""
    frames_per_step: int = Field(1, ge=1)
    """Frames that a step looks at; a GPU draws them at once [1]."""
    phases: tuple[float, float, float] = (0.2, 0.5, 0.7)
    """Ends of the coarse phase, of the trajectory phase and of the field's refinement; from the last on the field is
    frozen and the canonical scene refined [fraction of iterations]."""
    seed: int = 0
    """Seed of the frames' order and of the head's first weights [1]."""
    rest_every: int = Field(3, ge=0)
    """Every so many iterations frame 0 is looked at, out of turn: the canonical scene has to be it; 0 for never [1]."""
    device: Literal["cpu", "cuda"] = "cpu"
    """Where it is fitted; on 'cuda' gsplat draws, and two runs differ in the last digits [-]."""
    threads: int = Field(2, ge=1)
    """Threads of the linear algebra on the CPU; the result depends on it in the last digits [1]."""

    gaussians_per_pixel: float = Field(0.5, gt=0, le=1)
    """Gaussians to start from for each pixel of tissue [1/px]."""
    growth: float = Field(1.4, ge=1)
    """Bound on their number while some are dropped and others split [number at the start]."""
    most_gaussians: int = Field(25000, ge=50)
    """Bound on their number whatever the image's size [1]."""

    channels: int = Field(16, ge=1)
    """Features in each plane [1]."""
    knots: tuple[int, ...] = (16, 48)
    """Knots along the longest side of the box, one number a scale [1]."""
    knots_in_depth: tuple[int, ...] = (6, 12)
    """Knots along z, one number a scale [1]."""
    knots_in_time: tuple[float, ...] = (0.2, 0.6)
    """Knots along t, one number a scale [1/frame]."""
    cubic_in_time: bool = False
    """Whether knots along t are read by cubic B-splines, not in straight lines: better pictures between frames that are
    used, and, from pictures alone, motion that is twice as far off [-]."""
    head_width: int = Field(48, ge=1)
    """Neurons in each of the head's two hidden layers [1]."""

    trajectory: float = Field(0.1, ge=0)
    """Weight of the trajectory term, 0 switches it off [1]."""
    trajectory_form: str = Field("default", pattern="^(default|literal)$")
    """'default' asks neighbours for equal motion since the first frame, 'literal' is the paper's printed sum of dot
    products of motions since the previous one [-]."""
    neighbours: int = Field(5, ge=1)
    """Neighbours of each Gaussian in the trajectory term [1]."""
    correspondence: float = Field(0.3, ge=0)
    """Weight of how far the field carries Gaussians past where the surface was seen to go, 0 switches it off; of
    errors counted in 1 % of the longest image side [1]."""
    midway: float = Field(0.03, ge=0)
    """Weight of how far Gaussians are from half way in frames that are not looked at, where what was seen goes straight
    on there; 0 switches it off; counted in median first radii [1]."""
    anisotropy: float = Field(1.0, ge=0)
    """Weight of the anisotropic term, 0 switches it off [1]."""
    anisotropy_largest: float = Field(1.0, gt=0)
    """r_m, largest radius [anisotropy_unit]."""
    anisotropy_unit: float = Field(0.01, gt=0)
    """Length r_m is counted in, the paper's scenes have no unit; two median first radii where those are more [longest
    side of the scene]."""
    anisotropy_ratio: float = Field(3.0, ge=1)
    """r_ani, largest over smallest radius [1]."""
    pooled: float = Field(1.0, ge=0)
    """Weight of the colour misfit averaged over blocks, in the coarse phase only: it sees motions that are longer than
    the texture is wide [1]."""
    pooled_sizes: tuple[float, ...] = (0.025, 0.075)
    """Sides of the blocks [longest image side]."""
    squared: float = Field(1.0, ge=0)
    """Weight of the squared colour misfit beside the absolute one, of colours 0-1: few pixels that are far off, such as
    highlights, are what PSNR counts [1]."""
    structure: float = Field(0.2, ge=0)
    """Weight of one minus the structural similarity, in the last phase: pictures stay sharp [1]."""
    depth: float = Field(0.5, ge=0)
    """Weight of the depth misfit [1/median depth]."""
    tint: float = Field(0.01, ge=0)
    """Weight of how far colours change in time: what motion explains is left to it [1]."""
    knots_of_tint: tuple[Annotated[float, Field(gt=0)], ...] = Field((0.1, 0.3, 1.0), min_length=1)
    """Moments at which they may have changed, one number a scale; what the first scales leave the last tell
    [1/frame]."""
    smoothness_space: float = Field(0.002, ge=0)
    """Weight of the planes' squared differences in space [1]."""
    smoothness_time: float = Field(0.005, ge=0)
    """Weight of the time planes' squared second differences [1]."""

    weight_copied: float = Field(0.3, ge=0, le=1)
    """Weight of a pixel whose colour was copied from another frame; seen tissue weighs 1 [1]."""
    weight_invented: float = Field(0.03, ge=0, le=1)
    """Weight of a pixel whose colour was invented [1]."""
    weight_specular: float = Field(0.3, ge=0, le=1)
    """Weight of a highlight as long as colours stay as they are; then it weighs 1 [1]."""

    rate_mean: float = Field(2e-4, gt=0)
    """Step size of the centres [half longest side of the box]."""
    rate_color: float = Field(2e-3, gt=0)
    """Step size of the colours [1]."""
    rate_tint: float = Field(3e-2, gt=0)
    """Step size of how far colours change in time [1]."""
    rate_opacity: float = Field(2e-2, gt=0)
    """Step size of the opacities' logits [1]."""
    rate_scale: float = Field(5e-3, gt=0)
    """Step size of the radii's logarithms [1]."""
    rate_rotation: float = Field(2e-3, gt=0)
    """Step size of the quaternions [1]."""
    rate_planes: float = Field(5e-3, gt=0)
    """Step size of the feature planes [1]."""
    rate_head: float = Field(1e-3, gt=0)
    """Step size of the head's weights [1]."""
    rate_end: float = Field(0.1, gt=0, le=1)
    """All step sizes fall exponentially to this share of their start by the end [1]."""
