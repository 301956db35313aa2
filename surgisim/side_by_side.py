"""Work done side by side on as many threads as a job has, where what one part gives does not depend on the others."""

import ctypes
import importlib.util
import os
import sys
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

OPENMP = "libgomp.so.1"
"""The library that numba's loops and torch's share their threads by."""


def in_order(work: Callable[..., Any], items: Iterable[tuple]) -> Iterator[Any]:
    """work(*item) of every item, in their order, on as many threads as this process may use.

    Items are asked for on the calling thread, a few ahead of what is handed on, so that many large ones need not be
    kept at once.
    """
    if not together():
        yield from (work(*item) for item in items)
        return
    count = threads()
    with ThreadPoolExecutor(count) as pool:
        waiting = deque()
        for item in items:
            waiting.append(pool.submit(work, *item))
            if len(waiting) > 2 * count:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


def threads() -> int:
    """As OMP_NUM_THREADS says (its first number), which Snakemake sets for each job; else one for each processor."""
    told = os.environ.get("OMP_NUM_THREADS", "").split(",")[0]
    return int(told) if told else len(os.sched_getaffinity(0))


def together() -> bool:
    """Whether several threads may run compiled loops at once.

    Where numba finds no OpenMP it has a pool of its own, which ends the process when two threads use it
    (numba.readthedocs.io, "Threading layers").
    """
    if os.environ.get("NUMBA_THREADING_LAYER") == "workqueue":
        return False
    if "numba" in sys.modules:
        try:
            return sys.modules["numba"].threading_layer() != "workqueue"
        except ValueError:
            pass  # It has run no loop yet, and will look for OpenMP when it does.
    return openmp()


def openmp() -> bool:
    """Whether there is OpenMP: the machine's, or torch's own, which is loaded so that numba finds it."""
    if _loads(OPENMP):
        return True
    torch = importlib.util.find_spec("torch")
    for folder in torch.submodule_search_locations or () if torch else ():
        for library in sorted(Path(folder, "lib").glob("libgomp*.so*")):
            # Found by name from here on, where that is the name it has inside.
            if _loads(str(library)) and _loads(OPENMP):
                return True
    return False


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library, mode=ctypes.RTLD_GLOBAL)
    except OSError:
        return False
    return True
