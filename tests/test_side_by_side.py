import os
import subprocess
import sys
import threading
from itertools import pairwise

import cv2
import numpy as np
import pytest

from surgisim import side_by_side
from surgisim.perception.optical_flow.dis import dense_flow
from surgisim.side_by_side import in_order, openmp, together


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
    found_together = list(in_order(dense_flow, pairwise(frames)))
    assert cv2.getNumThreads() == 1
    assert not changed
    assert threading.active_count() == alone
    for found, (a, b) in zip(found_together, pairwise(frames), strict=True):
        assert np.array_equal(found, dense_flow(a, b))


LOOPS = """
import numba, numpy as np
from surgisim.side_by_side import in_order

@numba.njit(parallel=True)
def summed(a):
    total = 0.0
    for i in numba.prange(len(a)):
        total += a[i]
    return total

assert list(in_order(summed, ((np.full(200_000, float(n)),) for n in range(40)))) == [200_000.0 * n for n in range(40)]
print(numba.threading_layer())
"""


@pytest.mark.parametrize("layer", ["workqueue", "omp"])
def test_compiled_loops_meet_only_where_that_ends_no_process(layer):
    if layer == "omp" and not openmp():
        pytest.skip("NO OPENMP HERE: numba's loops run one at a time.")
    told = {"NUMBA_THREADING_LAYER": layer, "OMP_NUM_THREADS": "4", "NUMBA_NUM_THREADS": "2"}
    done = subprocess.run([sys.executable, "-c", LOOPS], env=os.environ | told, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-500:]
    assert done.stdout.strip() == layer


def test_torchs_openmp_serves_where_the_machine_has_none(monkeypatch):
    loaded = []

    def loads(library):
        loaded.append(library)
        return "/" in library or any("/" in earlier for earlier in loaded)

    monkeypatch.setattr(side_by_side, "_loads", loads)
    assert openmp()
    assert [("/" in library) for library in loaded] == [False, True, False]
    monkeypatch.setattr(side_by_side, "_loads", lambda library: False)
    assert not openmp()
    monkeypatch.setenv("NUMBA_THREADING_LAYER", "workqueue")
    assert not together()
