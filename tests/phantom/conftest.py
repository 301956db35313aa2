"""One small clip for all of this room's tests."""

import pytest
from tissue_pieces import SMALL

from surgisim.phantom.clip import film


@pytest.fixture(scope="session")
def small_film():
    return film(SMALL)
