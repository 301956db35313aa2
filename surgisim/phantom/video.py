"""Frames to the bytes of an H.264 file."""

import io
from fractions import Fraction

import av
import numpy as np

STEADY = "mbtree=0:asm=0"
"""x264's macroblock tree reads memory that it has not written: about one file in a hundred came out different."""


def encode(frames: np.ndarray, fps: float, crf: int) -> bytes:
    """(T, H, W, 3) uint8 to an mp4 that every browser plays; one thread, so the same frames give the same bytes."""
    stream = io.BytesIO()
    options = {"fflags": "+bitexact"}
    with av.open(stream, "w", format="mp4", options=options) as container:
        track = container.add_stream("libx264", rate=Fraction(fps).limit_denominator(1001))
        track.height, track.width = frames.shape[1:3]
        track.pix_fmt = "yuv420p"
        track.codec_context.thread_count = 1
        steady = {"threads": "1", "flags": "+bitexact", "x264-params": STEADY}
        track.codec_context.options = {"crf": str(crf), "preset": "slow"} | steady
        for frame in frames:
            for packet in track.encode(av.VideoFrame.from_ndarray(frame, format="rgb24")):
                container.mux(packet)
        for packet in track.encode():
            container.mux(packet)
    return stream.getvalue()
