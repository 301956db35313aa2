import pytest
from cheap_tree import Tree, cheap_tree


@pytest.fixture
def tree(tmp_path) -> Tree:
    return cheap_tree(tmp_path)


@pytest.fixture(scope="session")
def finished(tmp_path_factory) -> Tree:
    """A tree in which everything has been made; tests that change it put it back."""
    done = cheap_tree(tmp_path_factory.mktemp("finished"))
    assert done.run() == 0
    return done
