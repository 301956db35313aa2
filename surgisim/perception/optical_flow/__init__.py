"""Where each pixel of one frame went in another. A backend is one file here with a function `prepared`; its file name
is its name.

prepared(weights) -> Flow
"""

from collections.abc import Callable

import numpy as np

Flow = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""flow(a, b): displacement of each pixel of frame `a` on its way to frame `b`, x then y [px], (H, W, 2) float32. Frames
are sRGB (H, W, 3) or grey (H, W), uint8, of one size."""
