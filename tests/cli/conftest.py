import pytest
from cheap_tree import Tree, cheap_tree


@pytest.fixture
def tree(tmp_path) -> Tree:
    return cheap_tree(tmp_path)
