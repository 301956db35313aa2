"""Pictures and films as addresses that carry their own content."""

import base64

import cv2
import numpy as np


def data_uri(content: bytes, kind: str) -> str:
    """`kind` is a media type such as 'video/mp4'."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


def content(uri: str) -> bytes:
    """What such an address carries."""
    return base64.b64decode(uri.partition(";base64,")[2], validate=True)


def jpeg(rgb: np.ndarray, quality: int = 88) -> str:
    """A photograph, sRGB, (H, W, 3) uint8."""
    return data_uri(_encoded(".jpg", rgb, [cv2.IMWRITE_JPEG_QUALITY, quality]), "image/jpeg")


def png(rgb: np.ndarray) -> str:
    """A drawing with sharp edges, sRGB, (H, W, 3) uint8."""
    return data_uri(_encoded(".png", rgb, []), "image/png")


def _encoded(suffix: str, rgb: np.ndarray, options: list[int]) -> bytes:
    good, content = cv2.imencode(suffix, cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), options)
    if not good:
        raise ValueError(f"a picture of shape {rgb.shape} and type {rgb.dtype} could not be encoded")
    return content.tobytes()
