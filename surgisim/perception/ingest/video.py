"""A video file as frames, refused in one sentence when it cannot be read to its end."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import av
import numpy as np

from surgisim.problem import Problem

SUFFIXES = (".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".ts", ".wmv")
# Playlists may name other files and hosts, so only containers that hold their own pictures are opened.
OPTIONS = {"protocol_whitelist": "file", "format_whitelist": "mov,matroska,webm,avi,mpeg,mpegts,mpegvideo,asf,ogg"}


@dataclass(frozen=True)
class Video:
    path: Path
    fps: float
    """[1/s]"""
    promised: int
    """Frames the container announces, 0 where it does not."""
    ends: float
    """When the container says its pictures end [s], 0 where it does not."""

    def frames(self) -> Iterator[np.ndarray]:
        """Every frame in turn, sRGB, (H, W, 3) uint8."""
        count, last = 0, 0.0
        try:
            with av.open(str(self.path), options=OPTIONS) as container:
                stream = container.streams.video[0]
                stream.thread_type = "AUTO"
                for frame in container.decode(stream):
                    count, last = count + 1, frame.time or count / self.fps
                    yield frame.to_ndarray(format="rgb24")
        except av.error.FFmpegError as error:
            raise Problem(
                f"{self.path}: is damaged or cut short after frame {count} ({error.strerror}). Copy it again."
            ) from error
        self._refuse_short(count, last)

    def _refuse_short(self, count: int, last: float) -> None:
        missing = max(self.promised - count, round((self.ends - last) * self.fps) - 1 if self.ends else 0)
        if missing > max(2, 0.05 * count):
            raise Problem(
                f"{self.path}: is cut short; its header announces about {count + missing} frames and {count} can be "
                "read. Copy it again, or set ingest.end to use the part that is there."
            )


def opened(path: Path, *, max_pixels: int) -> Video:
    """What the header of a video says, once its codec and its size are known to be readable."""
    try:
        with av.open(str(path), options=OPTIONS) as container:
            if not container.streams.video:
                raise Problem(f"{path}: holds no video stream. Pass a video, an image folder or an EndoNeRF folder.")
            stream = container.streams.video[0]
            context = stream.codec_context
            if context is None:
                raise Problem(f"{path}: its codec cannot be decoded here. Convert it to H.264, say.")
            width, height = context.width, context.height
            rate = stream.average_rate or stream.guessed_rate or stream.base_rate
            promised, ends = stream.frames, _end(container, stream)
    except av.error.DecoderNotFoundError as error:
        raise Problem(f"{path}: its codec cannot be decoded here. Convert it to H.264, say.") from error
    except av.error.FFmpegError as error:
        raise Problem(
            f"{path}: is not a video that can be read ({error.strerror}); an mp4, avi or mkv file, an image folder or "
            "an EndoNeRF folder is wanted. Copy it again if it was cut short."
        ) from error
    if width * height > max_pixels:
        raise Problem(f"{path}: claims {width} x {height} px, but at most {max_pixels} px are decoded. Shrink it.")
    return Video(path, float(rate) if rate else 0.0, promised, ends)


def _end(container, stream) -> float:
    begin = float((stream.start_time or 0) * stream.time_base) if stream.time_base else 0.0
    if stream.duration and stream.time_base:
        return begin + float(stream.duration * stream.time_base)
    named = stream.metadata.get("DURATION", "")
    if named.count(":") == 2:
        hours, minutes, seconds = named.split(":")
        return int(hours) * 3600 + int(minutes) * 60 + float(seconds)
    if container.duration and len(container.streams) == 1:
        return container.duration / av.time_base
    return 0.0
