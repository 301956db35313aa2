"""Copies as flow_copy does, and lets a network invent what no frame saw.

The network is a local file. TorchScript (.pt): called as model(image, hole); ONNX (.onnx): inputs in that order. Both
take the image (1, 3, H, W) sRGB 0-1 and the hole (1, 1, H, W), 1 where it is to fill, and return the filled image, 0-1
or 0-255. LaMa's published exports have this form (Suvorov et al., Resolution-robust large mask inpainting, WACV 2022).
"""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from surgisim.config.inpainting import Inpainting
from surgisim.perception.inpainting.flow_copy import fill_with
from surgisim.perception.inpainting.smooth import continued
from surgisim.perception.torchscript import torchscript
from surgisim.problem import Problem

MULTIPLE = 8
"""Sides are padded to a multiple of this [px]."""
Model = Callable[[np.ndarray, np.ndarray], np.ndarray]


def fill(rgb: np.ndarray, hole: np.ndarray, settings: Inpainting, progress) -> tuple[np.ndarray, np.ndarray]:
    """Frames (T, H, W, 3) uint8 without their holes, and each pixel's origin (T, H, W) uint8."""
    model, side = _loaded(settings.weights)
    return fill_with(rgb, hole, settings, progress, invent=lambda frame, gap: _invented(model, side, frame, gap))


def _loaded(path: Path | None) -> tuple[Model, tuple[int, int] | None]:
    """The network and the only size (H, W) it takes, None when it takes any."""
    if path is None or not path.is_file():
        raise Problem(
            f"config key 'inpainting.weights': an inpainting network as TorchScript or ONNX is wanted, and "
            f"{'no path is given' if path is None else f'{path} is not there'}. LaMa is published by its authors as "
            "big-lama; meanwhile use inpainting.backend: flow_copy, which needs no weights."
        )
    if path.suffix == ".onnx":
        return _onnx(path)
    if path.suffix in (".pt", ".ts", ".jit"):
        return _torchscript(path), None
    raise Problem(f"{path}: ends in '{path.suffix}', but a TorchScript (.pt) or ONNX (.onnx) network is wanted.")


def _torchscript(path: Path) -> Model:
    import torch

    model = torchscript(
        path, export="Export the network with torch.jit.save, or use inpainting.backend: flow_copy, which needs none."
    )

    def run(image: np.ndarray, gap: np.ndarray) -> np.ndarray:
        with torch.inference_mode():
            return model(torch.from_numpy(image), torch.from_numpy(gap)).numpy()

    return run


def _onnx(path: Path) -> tuple[Model, tuple[int, int] | None]:
    try:
        import onnxruntime
    except ImportError as error:
        raise Problem(f"{path}: needs onnxruntime. Install the project with its extra [learned].") from error
    from onnxruntime.capi.onnxruntime_pybind11_state import Fail, InvalidGraph, InvalidProtobuf

    try:
        session = onnxruntime.InferenceSession(str(path), providers=onnxruntime.get_available_providers())
    except (Fail, InvalidGraph, InvalidProtobuf) as error:
        first = str(error).splitlines()[0]
        raise Problem(f"{path}: cannot be loaded as ONNX ({first}). Fetch the file again.") from error
    inputs = session.get_inputs()
    if len(inputs) != 2:
        raise Problem(f"{path}: takes {len(inputs)} inputs, but two are wanted: the image and its hole.")
    sides = inputs[0].shape[2:]
    fixed = tuple(sides) if all(isinstance(s, int) for s in sides) else None
    names = [i.name for i in inputs]
    return lambda image, gap: session.run(None, dict(zip(names, (image, gap), strict=True)))[0], fixed


def _invented(model: Model, side: tuple[int, int] | None, frame: np.ndarray, gap: np.ndarray) -> np.ndarray:
    """The frame with its gap filled by the network; pixels outside the gap stay as they are."""
    height, width = gap.shape
    padded = side or (-(-height // MULTIPLE) * MULTIPLE, -(-width // MULTIPLE) * MULTIPLE)
    known = np.clip(continued(frame.astype(np.float32), ~gap), 0, 255)
    if side:
        image = cv2.resize(known, padded[::-1], interpolation=cv2.INTER_AREA)
        hole = cv2.resize(gap.astype(np.float32), padded[::-1], interpolation=cv2.INTER_NEAREST)
    else:
        below, beside = padded[0] - height, padded[1] - width
        image = cv2.copyMakeBorder(known, 0, below, 0, beside, cv2.BORDER_REPLICATE)
        hole = cv2.copyMakeBorder(gap.astype(np.float32), 0, below, 0, beside, cv2.BORDER_REPLICATE)
    image = (image / 255).transpose(2, 0, 1)[None].astype(np.float32)
    answer = np.asarray(model(image * (1 - hole), hole[None, None].astype(np.float32)))[0].transpose(1, 2, 0)
    if answer.shape[:2] != padded or not np.isfinite(answer).all():
        raise Problem(
            f"the inpainting network returned {answer.shape} for {padded}, or values that are no numbers. "
            "Use another network, or inpainting.backend: flow_copy."
        )
    # Exports differ in whether they return 0-1 or 0-255; no picture reaches 2 of 255 only.
    answer = np.clip(answer * (255 if answer.max() <= 2 else 1), 0, 255).astype(np.float32)
    answer = cv2.resize(answer, (width, height)) if side else answer[:height, :width]
    return np.where(gap[..., None], np.rint(answer), frame).astype(np.uint8)
