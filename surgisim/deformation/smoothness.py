"""Keeps the feature planes smooth in space and in time.

    L_space = sum over planes, mean over knots of (V[i+1] - V[i])^2 along the axes of space
    L_time  = sum over time planes, mean over knots of (V[k+1] - 2 V[k] + V[k-1])^2

as Fridovich-Keil et al., K-Planes, 2023, section 3.2. What no frame shows takes what its neighbours in time have.
"""

import torch

from surgisim.deformation.planes import Layout


def roughness(flat: torch.Tensor, layout: Layout) -> tuple[torch.Tensor, torch.Tensor]:
    """L_space and L_time of all planes end to end."""
    space, time = flat.new_zeros(()), flat.new_zeros(())
    for scale in range(len(layout.sizes)):
        for index in range(6):
            plane = layout.plane(flat, scale, index)
            space = space + plane.diff(dim=1).square().mean()
            if index < 3:
                space = space + plane.diff(dim=0).square().mean()
            elif len(plane) > 2:
                time = time + plane.diff(n=2, dim=0).square().mean()
    return space, time
