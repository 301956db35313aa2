"""What is kept of a diagnosis: made once, whoever asks, and found again."""

from threading import Barrier

import numpy as np

from surgisim.diagnosis.memo import Memo
from surgisim.estimation.trial import at_once


def test_threads_that_want_one_thing_at_once_get_it_made_once(tmp_path):
    memo, start, made = Memo(tmp_path, "a recording"), Barrier(4), []

    def wanted(n, _):
        start.wait()
        return memo(["a run", 3], lambda: made.append(n) or {"seen": np.arange(1e6)})["seen"]

    results = at_once(wanted, list(range(4)), 4)
    assert len(made) == 1
    assert all((result == np.arange(1e6)).all() for result in results)
    assert [path.suffix for path in tmp_path.iterdir()] == [".npz"]


def test_what_was_made_is_found_again_unless_recording_or_settings_differ(tmp_path):
    def failing():
        raise AssertionError("made again")

    Memo(tmp_path, "a recording")("a run", lambda: {"seen": np.ones(3)})
    assert (Memo(tmp_path, "a recording")("a run", failing)["seen"] == 1).all()
    assert (Memo(tmp_path, "another")("a run", lambda: {"seen": np.zeros(3)})["seen"] == 0).all()
