"""What the Gaussians are asked to be: like the picture, round, and moving with their neighbours.

Wang, Yang, Zhao, Yang and Shen, Realistic surgical simulation from monocular videos, section 3.2 ("the paper").
Every sum over Gaussians, groups or pixels is a mean here, so that a weight keeps its meaning when their number
changes.
"""

from functools import lru_cache

import torch

TINY = 1e-20
"""Keeps the mean over nothing at 0."""
SSIM_SIGMA, SSIM_RADIUS = 1.5, 5
"""Gaussian window of the structural similarity [px]."""


def masked_l1(value: torch.Tensor, target: torch.Tensor, mask: torch.Tensor) -> torch.Tensor:
    """Mean of |value - target| where `mask` (..., H, W) is true (or weighted, 0-1); 0 when it is nowhere.

    value, target: (..., H, W) or (..., H, W, C), in one unit, which is the result's too.
    """
    weight = mask.to(value.dtype)
    channels = value.numel() // mask.numel()
    total = (weight.reshape(*mask.shape, *[1] * (value.ndim - mask.ndim)) * (value - target).abs()).sum()
    return total / (weight.sum() * channels).clamp(min=TINY)


def structure(value: torch.Tensor, target: torch.Tensor, mask: torch.Tensor) -> torch.Tensor:
    """Keeps what is drawn as sharp as what was seen.

        L_ssim = sum_p w_p (1 - SSIM_p) / sum_p w_p

    value, target: colours 0-1, (B, H, W, C), sides over SSIM_RADIUS; mask: w, 0-1, (B, H, W). SSIM as
    `measure.ssim` computes it (Wang, Bovik, Sheikh and Simoncelli, Image quality assessment, 2004). What a pixel does
    not count for, the target stands in for, so that no edge of the mask is taken for one of the picture.
    """
    drawn = torch.lerp(target, value, mask[..., None].to(value.dtype)).permute(0, 3, 1, 2)
    seen = target.permute(0, 3, 1, 2)
    down, across = (_blur(side, value.dtype, value.device) for side in seen.shape[2:])
    # As products of matrices: as convolutions they take thirteen times as long on a CPU, and short floats on a GPU.
    b, bb = down @ (torch.stack([seen, seen * seen]) @ across.T)
    a, aa, ab = down @ (torch.stack([drawn, drawn * drawn, drawn * seen]) @ across.T)
    c1, c2 = 0.01**2, 0.03**2
    alike = (2 * a * b + c1) * (2 * (ab - a * b) + c2) / ((a * a + b * b + c1) * (aa - a * a + bb - b * b + c2))
    weight = mask.to(value.dtype)
    return (weight[:, None] * (1 - alike)).sum() / (weight.sum() * seen.shape[1]).clamp(min=TINY)


@lru_cache(maxsize=16)
def _blur(side: int, dtype: torch.dtype, device: torch.device) -> torch.Tensor:
    """What blurs a line of pixels as SSIM does, mirrored at its ends, (N, N)."""
    offset = torch.arange(-SSIM_RADIUS, SSIM_RADIUS + 1)
    window = torch.softmax(-(offset.to(dtype) ** 2) / (2 * SSIM_SIGMA**2), 0)
    at = (torch.arange(side)[:, None] + offset).abs()
    at = torch.where(at < side, at, 2 * (side - 1) - at)
    return torch.zeros(side, side, dtype=dtype).scatter_add_(1, at, window.expand(side, -1)).to(device)


def anisotropic(scale: torch.Tensor, *, unit: float, r_m: float = 1.0, r_ani: float = 3.0) -> torch.Tensor:
    """Keeps Gaussians from growing large or thin.

        L_geo = mean_i ReLU(max(S_i) / unit - r_m) + ReLU(max(S_i) / min(S_i) - r_ani)

    scale: radii [m], (G, 3). unit: the length that r_m is counted in [m]. The paper, equation of L_geo, whose
    scenes have no unit (r_m = 1, r_ani = 3).
    """
    largest, smallest = scale.amax(1), scale.amin(1)
    return (torch.relu(largest / unit - r_m) + torch.relu(largest / smallest - r_ani)).mean()


def trajectory(motion: torch.Tensor, groups: torch.Tensor, *, literal: bool = False) -> torch.Tensor:
    """Keeps neighbours on parallel paths.

        L_traj = mean_i mean_{j,k in N_i} |d_j - d_k|^2  =  mean_i 2/n sum_j |d_j - mean of d|^2
        literal:  mean_i mean_{j,k in N_i} d_j . d_k     =  mean_i |mean of d|^2

    motion: of each Gaussian, d [any length], (G, 3). groups: N_i, (M, n). The paper, equation trajloss, is `literal`,
    of the motion since the previous frame: minimised, it asks each group to stand still on average, which neighbours
    moving in opposite directions satisfy. The default is 0 when they move alike, and is of the motion since the first
    frame: what a long pull adds up to is what parts neighbours, not one frame's share of it.
    """
    moves = motion[groups]
    middle = moves.mean(1)
    if literal:
        return middle.square().sum(1).mean()
    return 2 * (moves - middle[:, None]).square().sum(2).mean()


def followed(
    moved: torch.Tensor, went: torch.Tensor, sure: torch.Tensor, *, unit: float, soft: float = 0.1
) -> torch.Tensor:
    """Keeps points where they were seen to go.

        L_fol = sum_i w_i (sqrt(|m_i - g_i|^2 / u^2 + s^2) - s) / sum_i w_i

    moved, went: m, how far points have gone in the picture, and g, how far they were seen to go [px], (G, 2). sure: w,
    how much that counts, 0-1, (G,). unit: u [px]. soft: s, below which the square counts [unit].
    """
    away = ((moved - went) / unit).square().sum(1)
    return (sure * ((away + soft**2).sqrt() - soft)).sum() / sure.sum().clamp(min=1)


def total_variation(value: torch.Tensor, neighbours: torch.Tensor) -> torch.Tensor:
    """Keeps a quantity alike between neighbours, and free to jump where it must.

        L_tv = mean_i mean_{j in N_i} |v_i - v_j|

    value: (G,) or (G, C), |.| summed over C. neighbours: (G, k). Rudin, Osher and Fatemi, Nonlinear total
    variation based noise removal algorithms, Physica D 60 (1992), on a graph.
    """
    value = value.reshape(len(value), -1)
    return (value[:, None] - value[neighbours]).abs().sum(2).mean()
