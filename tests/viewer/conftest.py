"""One run of a slab, shared by the tests of the viewer."""

import pytest
from cases import run_folder


@pytest.fixture(scope="session")
def out(tmp_path_factory):
    return tmp_path_factory.mktemp("run")


@pytest.fixture(scope="session")
def case(out):
    return run_folder(out)
