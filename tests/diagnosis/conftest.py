import os

import planted
import pytest


@pytest.fixture(scope="session", autouse=True)
def runs(tmp_path_factory):
    """Runs of planted recordings are kept for all test processes of a session."""
    own = tmp_path_factory.getbasetemp()
    planted.RUNS = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "planted"
    planted.RUNS.mkdir(exist_ok=True)
