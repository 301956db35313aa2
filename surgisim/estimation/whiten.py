"""What is left of residuals once an error that is known up to a few numbers is integrated out."""

import numpy as np


def inverse_root(gram: np.ndarray) -> np.ndarray:
    """M, (Q, Q), such that (1 + B B^T)^(-1/2) = 1 - B M B^T, from gram = B^T B, (Q, Q)."""
    value, vector = np.linalg.eigh(gram)
    value = np.maximum(value, 1e-12)
    return (vector * ((1 - 1 / np.sqrt(1 + value)) / value)) @ vector.T
