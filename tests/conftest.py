"""What tests of several rooms use."""

import os
import time
from collections import Counter
from pathlib import Path

import pytest

# Before torch is imported anywhere: on a busy machine its idle threads, spinning, would keep both cores from working.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
# Before numpy is: threads of its small matrices would wait for one another, where several tests or runs share cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

SHARED = Path(__file__).parents[2] / "shared"


@pytest.fixture(scope="session")
def shared() -> Path:
    """Recordings and weights beside the project; a test that needs them is skipped where they are not."""
    if not SHARED.is_dir():
        pytest.skip(f"NO SHARED DATA: {SHARED} is not there, so this test did not run.")
    return SHARED


SLOW = 15
"""What a slow test takes that does not say how long it does [s]: `@pytest.mark.slow(seconds)`."""


UNTIL = float(os.environ.get("SLOW_TESTS_UNTIL", "inf"))
"""When no slow test is begun any more [s since 1970]: what has a limit sets it, so that a machine that is far slower
than others leaves the rest of them out, and says so, instead of being cut off in the middle."""


def pytest_runtest_setup(item: pytest.Item) -> None:
    if time.time() > UNTIL and item.get_closest_marker("slow"):
        pytest.skip("NOT BEGUN: too slow a machine for all slow tests within its limit. `make test-slow` runs them.")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest files first, so that no worker is left alone with one at the end."""
    long: Counter[Path] = Counter()
    for item in items:
        if marker := item.get_closest_marker("slow"):
            long[item.path] += marker.args[0] if marker.args else SLOW
    items.sort(key=lambda item: -long[item.path])
