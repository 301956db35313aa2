"""Frames as an mp4 that every browser plays."""

import io
from fractions import Fraction

import av
import numpy as np

from surgisim.problem import Problem

BT709 = 1
THREADS = 4
"""Of the encoder, whose result depends on it."""


def mp4(frames: np.ndarray, fps: float, *, quality: int = 21) -> bytes:
    """H.264 (baseline, 4:2:0) of frames, sRGB, (T, H, W, 3) uint8, at `fps` [1/s].

    `quality` is x264's constant rate factor: lower is better and larger, 18 looks lossless.
    Odd sizes are padded by repeating the last row or column. So many threads on every machine and no clock, so the
    same frames give the same bytes.
    """
    if frames.ndim != 4 or frames.shape[3] != 3 or frames.dtype != np.uint8 or len(frames) == 0:
        raise Problem(f"video: frames are {frames.dtype} {frames.shape}, but uint8 (T > 0, H, W, 3) is wanted.")
    frames = np.pad(frames, ((0, 0), (0, frames.shape[1] % 2), (0, frames.shape[2] % 2), (0, 0)), "edge")
    target = io.BytesIO()
    with av.open(target, "w", format="mp4", options={"fflags": "+bitexact"}) as container:
        stream = container.add_stream("libx264", rate=Fraction(fps).limit_denominator(1001))
        stream.height, stream.width = frames.shape[1:3]
        stream.pix_fmt = "yuv420p"
        stream.options = {"crf": str(quality), "preset": "medium", "profile": "baseline", "threads": str(THREADS)}
        context = stream.codec_context
        context.thread_count = THREADS
        # Untagged colour is guessed from the picture's height, so a tall strip would change its hue.
        context.colorspace = context.color_primaries = context.color_trc = BT709
        context.color_range = av.video.reformatter.ColorRange.MPEG
        for rgb in frames:
            picture = av.VideoFrame.from_ndarray(rgb, format="rgb24").reformat(
                format="yuv420p", dst_colorspace="ITU709", dst_color_range="MPEG"
            )
            container.mux(stream.encode(picture))
        container.mux(stream.encode())
    return target.getvalue()
