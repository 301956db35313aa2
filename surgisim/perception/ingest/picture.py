"""One still image, its header believed before its pixels are decoded."""

import io
import warnings

import numpy as np
from PIL import Image, UnidentifiedImageError

from surgisim.problem import Problem

SUFFIXES = (".png", ".jpg", ".jpeg")
ALPHA = ("LA", "La", "PA", "RGBA", "RGBa")
DEEP = ("I", "I;16", "I;16B", "I;16L", "I;16N", "F")


def colour(data: bytes, name: str, *, max_pixels: int) -> np.ndarray:
    """An 8-bit colour image without transparency, sRGB, (H, W, 3) uint8."""
    image = _opened(data, name, max_pixels)
    _refuse_alpha(image, name)
    if _deep(data, image):
        raise Problem(f"{name}: has 16 bits a channel, but 8 are wanted. Convert the images to 8-bit PNG or JPEG.")
    return _pixels(image, name, "RGB")


def grey(data: bytes, name: str, *, max_pixels: int) -> np.ndarray:
    """A mask: brightness of an 8-bit image without transparency, (H, W) uint8."""
    image = _opened(data, name, max_pixels)
    _refuse_alpha(image, name)
    if _deep(data, image):
        raise Problem(f"{name}: has 16 bits a channel, but a mask has 8. Convert the masks to 8-bit PNG.")
    return _pixels(image, name, "L")


def depth(data: bytes, name: str, *, max_pixels: int) -> np.ndarray:
    """A depth image of one channel, 8 or 16 bits, as stored, (H, W) uint16."""
    image = _opened(data, name, max_pixels)
    if image.mode not in ("L", *DEEP):
        raise Problem(f"{name}: is {image.mode}, but a depth image has one grey channel. Pass depth as grey PNG.")
    values = _pixels(image, name, None)
    if values.min() < 0 or values.max() > 65535 or not np.all(values == np.round(values)):
        raise Problem(f"{name}: depth goes from {values.min()} to {values.max()}, but 0 to 65535 steps are wanted.")
    return values.astype(np.uint16)


def size(data: bytes, name: str, *, max_pixels: int) -> tuple[int, int]:
    """Height and width by the header alone [px]."""
    width, height = _opened(data, name, max_pixels).size
    return height, width


def _opened(data: bytes, name: str, max_pixels: int) -> Image.Image:
    try:
        # Only the header is read here; the two formats are the only decoders that may look at it.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            image = Image.open(io.BytesIO(data), formats=["PNG", "JPEG"])
    except Image.DecompressionBombError as error:
        raise Problem(f"{name}: claims too many pixels ({error}). Pass images of at most {max_pixels}.") from error
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError) as error:
        raise Problem(f"{name}: is not a PNG or JPEG image, or its header is damaged. Copy it again.") from error
    width, height = image.size
    if width * height > max_pixels:
        raise Problem(
            f"{name}: claims {width} x {height} px, but at most {max_pixels} px are decoded. "
            "Shrink it, or raise ingest.max_pixels if it is honest."
        )
    return image


def _pixels(image: Image.Image, name: str, mode: str | None) -> np.ndarray:
    try:
        image.load()
        return np.array(image if mode is None else image.convert(mode))
    except (OSError, SyntaxError, ValueError, EOFError) as error:
        raise Problem(f"{name}: is cut short or damaged ({error}). Copy it again.") from error


def _refuse_alpha(image: Image.Image, name: str) -> None:
    if image.mode in ALPHA or "transparency" in image.info:
        raise Problem(f"{name}: has a transparency (alpha) channel. Save the images without it.")


def _deep(data: bytes, image: Image.Image) -> bool:
    # The depth of a PNG's channels stands in byte 24; the mode alone hides 16-bit colour, which is cut to 8.
    return image.mode in DEEP or (image.format == "PNG" and data[24] == 16)
