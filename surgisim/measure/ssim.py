"""Structural similarity: whether two pictures have the same local structure."""

import numpy as np
from skimage.metrics import structural_similarity


def ssim(image: np.ndarray, reference: np.ndarray, mask: np.ndarray) -> float:
    """Mean over the pixels of `mask` of the similarity map [1]; NaN without a pixel.

    Pictures, sRGB, (H, W, 3) uint8; mask (H, W) bool. Pixels outside the mask are black in both
    pictures, so the tool counts for neither. Gaussian window, sigma 1.5 px, K1 0.01, K2 0.03, mean
    of the three channels: Wang, Bovik, Sheikh and Simoncelli, Image quality assessment, 2004.
    """
    if not mask.any():
        return float("nan")
    blacked = [np.where(mask[..., None], picture, 0) for picture in (image, reference)]
    _, similarity = structural_similarity(
        *blacked, channel_axis=2, data_range=255, gaussian_weights=True, use_sample_covariance=False, full=True
    )
    return float(similarity[mask].mean(dtype=np.float64))
