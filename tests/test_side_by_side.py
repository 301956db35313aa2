import threading
from itertools import pairwise

import cv2
import numpy as np
import pytest

from surgisim.perception.flow import dense_flow
from surgisim.side_by_side import in_order


@pytest.mark.parametrize("count", ["1", "3,2"])
def test_results_come_in_order_and_only_a_few_ahead(monkeypatch, count):
    monkeypatch.setenv("OMP_NUM_THREADS", count)
    asked = []

    def items():
        for n in range(50):
            asked.append(n)
            yield (n,)

    for n, result in enumerate(in_order(lambda n: n * n, items())):
        assert result == n * n
        assert len(asked) <= n + 2 * int(count[0]) + 2


def test_an_error_in_one_frame_stops_the_whole(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    with pytest.raises(ZeroDivisionError):
        list(in_order(lambda n: 1 // (n - 3), ((n,) for n in range(9))))


def test_flow_is_the_same_side_by_side_and_opencvs_threads_never_change(monkeypatch):
    rng = np.random.default_rng(0)
    frames = [cv2.GaussianBlur(rng.integers(0, 255, (96, 128), dtype=np.uint8), (0, 0), 2) for _ in range(6)]
    monkeypatch.setenv("OMP_NUM_THREADS", "4")
    alone, changed = threading.active_count(), []
    monkeypatch.setattr(cv2, "setNumThreads", changed.append)
    together = list(in_order(dense_flow, pairwise(frames)))
    assert cv2.getNumThreads() == 1
    assert not changed
    assert threading.active_count() == alone
    for found, (a, b) in zip(together, pairwise(frames), strict=True):
        assert np.array_equal(found, dense_flow(a, b))
