"""Peak signal-to-noise ratio: how far two pictures' colours are apart."""

import numpy as np


def psnr(image: np.ndarray, reference: np.ndarray, mask: np.ndarray) -> float:
    """10 log10(255^2 / mean squared difference) over the pixels of `mask` [dB].

    Pictures, sRGB, (H, W, 3) uint8; mask (H, W) bool. Computed in float64. NaN without a pixel,
    infinite for equal pictures.
    """
    if not mask.any():
        return float("nan")
    difference = image[mask].astype(np.float64) - reference[mask].astype(np.float64)
    error = np.mean(difference**2)
    return float("inf") if error == 0 else float(10 * np.log10(255.0**2 / error))
