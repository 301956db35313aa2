"""Films: what goes in comes out, and the same film is the same file."""

import io

import av
import numpy as np
import pytest

from surgisim.problem import Problem
from surgisim.video import mp4

FILM = np.zeros((7, 41, 47, 3), np.uint8)
FILM[:] = (200, 80, 60)
FILM[:, 8:28, 8:28] = (30, 180, 90)


def decoded(content: bytes) -> tuple[np.ndarray, av.VideoStream]:
    with av.open(io.BytesIO(content)) as container:
        return np.stack([f.to_ndarray(format="rgb24") for f in container.decode(video=0)]), container.streams.video[0]


def test_an_odd_film_is_padded_and_keeps_its_colours():
    frames, _ = decoded(mp4(FILM, 25))
    assert frames.shape == (7, 42, 48, 3)
    for row, column in ((35, 35), (18, 18)):
        assert np.abs(frames[3, row, column].astype(int) - FILM[3, row, column]).max() <= 6


def test_it_is_what_every_browser_plays():
    _, stream = decoded(mp4(FILM, 12.5))
    assert stream.codec_context.name == "h264"
    assert "Baseline" in stream.codec_context.profile
    assert stream.codec_context.pix_fmt == "yuv420p"
    assert float(stream.average_rate) == 12.5


def test_the_same_frames_are_the_same_bytes():
    assert mp4(FILM, 25) == mp4(FILM, 25)


def test_what_is_no_film_is_refused():
    for wrong in (FILM[:0], FILM.astype(float), FILM[0]):
        with pytest.raises(Problem, match="wanted"):
            mp4(wrong, 25)
