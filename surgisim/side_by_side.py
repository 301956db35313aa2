"""Work done side by side on as many threads as a job has, where what one part gives does not depend on the others."""

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any


def in_order(work: Callable[..., Any], items: Iterable[tuple]) -> Iterator[Any]:
    """work(*item) of every item, in their order, on as many threads as this process may use.

    Items are asked for on the calling thread, a few ahead of what is handed on, so that many large ones need not be
    kept at once.
    """
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
