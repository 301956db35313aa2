"""Learned perceptual distance between two pictures, with AlexNet's features.

Zhang, Isola, Efros, Shechtman and Wang, The unreasonable effectiveness of deep features as a
perceptual metric, CVPR 2018; version 0.1, linear heads.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from safetensors import SafetensorError
from safetensors.torch import load_file
from torch.nn.functional import conv2d, max_pool2d, relu

from surgisim.problem import Problem

SHIFT, SCALE = torch.tensor([-0.030, -0.088, -0.188]), torch.tensor([0.458, 0.448, 0.450])
LAYERS = {0: (4, 2), 3: (1, 2), 6: (1, 1), 8: (1, 1), 10: (1, 1)}
"""Convolution of AlexNet -> stride and padding [px]; pooling goes before 3 and 6."""
SMALLEST = 32
"""Below this height or width [px] the last layers see nothing but padding."""


@dataclass(frozen=True)
class Lpips:
    weights: dict[str, torch.Tensor]

    def __call__(self, image: np.ndarray, reference: np.ndarray, mask: np.ndarray) -> float:
        """Distance of two pictures, sRGB, (H, W, 3) uint8 [1]; 0 for equal ones.

        Pixels outside `mask`, (H, W) bool, are black in both, so the tool counts for neither.
        """
        pair = np.stack([np.where(mask[..., None], picture, 0) for picture in (image, reference)])
        with torch.no_grad():
            x = torch.from_numpy(pair).permute(0, 3, 1, 2).float() / 127.5 - 1
            x = (x - SHIFT[:, None, None]) / SCALE[:, None, None]
            distance = 0.0
            for head, (layer, (stride, padding)) in enumerate(LAYERS.items()):
                x = max_pool2d(x, 3, 2) if layer in (3, 6) else x
                w, b = self.weights[f"features.{layer}.weight"], self.weights[f"features.{layer}.bias"]
                x = relu(conv2d(x, w, b, stride, padding))
                unit = x / (x.square().sum(1, keepdim=True).sqrt() + 1e-10)
                apart = (unit[:1] - unit[1:]).square()
                distance += conv2d(apart, self.weights[f"lin{head}.weight"]).mean().item()
        return distance


def load_lpips(path: Path) -> Lpips:
    """The metric with weights from a safetensors file: features.{0,3,6,8,10}.{weight,bias}, lin{0..4}.weight."""
    try:
        weights = load_file(path)
    except (SafetensorError, OSError) as error:
        raise Problem(
            f"{path}: cannot be read as LPIPS weights ({error}). Pass a safetensors file of AlexNet's features and "
            "LPIPS 0.1's heads, or leave evaluation.lpips_weights empty to do without."
        ) from error
    wanted = {f"features.{n}.{part}" for n in LAYERS for part in ("weight", "bias")} | {
        f"lin{n}.weight" for n in range(len(LAYERS))
    }
    if missing := sorted(wanted - set(weights)):
        raise Problem(f"{path}: lacks {missing} of LPIPS's weights. Pass AlexNet's features with LPIPS 0.1's heads.")
    return Lpips({name: weights[name].float() for name in wanted})
