"""Depth by Depth Anything v2, a network loaded from a folder; never from the net.

Yang and others, Depth anything v2, 2024. Its relative models give disparity up to a scale and an offset; its metric
models give metres.
"""

import json
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from surgisim.perception.depth.complete import complete
from surgisim.problem import Problem

MEAN, SPREAD = np.array([0.485, 0.456, 0.406], np.float32), np.array([0.229, 0.224, 0.225], np.float32)
ELSEWHERE = (
    "It is published as depth-anything/Depth-Anything-V2-Small-hf (config.json and model.safetensors); set "
    "depth.weights to a folder that holds both, or depth.backend to 'near_light', which needs no weights."
)


def estimate(
    rgb: np.ndarray,
    hidden: np.ndarray,
    weights: Path | None,
    *,
    distance: float,
    range_: float,
    side: int = 518,
    progress: Callable[[float, float, str], None] | None = None,
) -> tuple[np.ndarray, np.ndarray, str]:
    """Depth [m], confidence (T, H, W) and whether its scale is known.

    rgb: sRGB (T, H, W, 3) uint8. hidden: pixels that are not the tissue's own, (T, H, W) bool. distance: median depth
    of frame 0 [m] and range_: farthest over nearest there, for models that give neither. side: shorter side at
    which the network looks [px].
    """
    model, metric = _load(weights)
    found = []
    for t, frame in enumerate(rgb):
        found.append(_infer(model, frame, side))
        if progress:
            progress(t + 1, len(rgb), "depth anything")
    found = np.stack(found)
    if not np.isfinite(found).all():
        frame = int(np.flatnonzero(~np.isfinite(found).all((1, 2)))[0])
        raise Problem(f"depth: the network in {weights} gives no finite depth in frame {frame}. {ELSEWHERE}")
    usable = ~hidden
    if metric:
        z, trust = complete(found, found > 0, usable)
        return z, 0.7 * trust, "known"
    near = _aligned(found, usable)
    low, high = np.percentile(near[0][usable[0]] if usable[0].any() else near[0], [1, 99])
    if not high > low:
        raise Problem(f"depth: the network in {weights} sees no relief at all. {ELSEWHERE}")
    # Disparity 1 nearest and 1 / range_ farthest; what lies beyond either end keeps its order.
    inverse = 1 / range_ + (1 - 1 / range_) * (near - low) / (high - low)
    z = 1 / np.where(inverse > 0.5 / range_, inverse, 0.5 / range_ * np.exp(inverse * 2 * range_ - 1))
    z *= distance / np.median(z[0][usable[0]] if usable[0].any() else z[0])
    z, trust = complete(z, np.ones_like(usable), usable)
    return z, 0.6 * trust, "arbitrary"


def _load(weights: Path | None):
    where = "depth: backend 'depth_anything'"
    if weights is None:
        raise Problem(f"{where} needs the setting depth.weights. {ELSEWHERE}")
    if not (weights / "config.json").is_file():
        raise Problem(f"{where} looks for {weights / 'config.json'}, and there is no such file. {ELSEWHERE}")
    if not any((weights / name).is_file() for name in ("model.safetensors", "model.safetensors.index.json")):
        raise Problem(f"{where} looks for {weights / 'model.safetensors'}, and there is no such file. {ELSEWHERE}")
    kind = json.loads((weights / "config.json").read_text()).get("model_type")
    if kind != "depth_anything":
        raise Problem(f"{where}: {weights / 'config.json'} describes a model of type {kind!r}. {ELSEWHERE}")
    try:
        from transformers import DepthAnythingForDepthEstimation
    except ImportError as error:
        raise Problem(
            f"{where} needs the package transformers: install surgisim[learned], or set depth.backend to 'near_light'."
        ) from error
    model = DepthAnythingForDepthEstimation.from_pretrained(weights, local_files_only=True, use_safetensors=True)
    return model.eval(), getattr(model.config, "depth_estimation_type", "relative") == "metric"


def _infer(model, frame: np.ndarray, side: int) -> np.ndarray:
    import torch

    height, width = frame.shape[:2]
    patch = model.config.patch_size
    scale = side / min(height, width)
    size = [max(patch, patch * round(scale * n / patch)) for n in (width, height)]
    image = cv2.resize(frame, size, interpolation=cv2.INTER_CUBIC).astype(np.float32) / 255
    batch = torch.from_numpy(((image - MEAN) / SPREAD).transpose(2, 0, 1)[None])
    with torch.inference_mode():
        out = model(pixel_values=batch).predicted_depth[0].float().numpy()
    return cv2.resize(out, (width, height), interpolation=cv2.INTER_LINEAR)


def _aligned(found: np.ndarray, usable: np.ndarray) -> np.ndarray:
    """Each frame brought to frame 0 by the scale and offset that most of its pixels ask for."""
    out = [found[0]]
    for t in range(1, len(found)):
        both = usable[0] & usable[t]
        if both.sum() < 16:
            out.append(found[t])
            continue
        have, want = found[t][both], found[0][both]
        quartiles = np.percentile([have, want], [25, 50, 75], axis=1)
        slope = (quartiles[2, 1] - quartiles[0, 1]) / max(quartiles[2, 0] - quartiles[0, 0], 1e-9)
        offset = quartiles[1, 1] - slope * quartiles[1, 0]
        for _ in range(20):
            rest = np.abs(slope * have + offset - want)
            weight = 1 / (1 + (rest / (np.median(rest) + 1e-9)) ** 2)
            slope, offset = np.polyfit(have, want, 1, w=weight)
        out.append(slope * found[t] + offset if slope > 0 else found[t])
    return np.stack(out)
