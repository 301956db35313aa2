"""Pages link to nothing that is not there."""

from pathlib import Path

import pytest
from links import dead

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("page", sorted((ROOT / "docs").rglob("*.html")), ids=lambda p: str(p.relative_to(ROOT)))
def test_a_page_that_is_kept_has_no_dead_link(page):
    assert dead(page) == []


def test_a_dead_link_is_found(tmp_path):
    (tmp_path / "there.html").write_text("")
    (tmp_path / "page.html").write_text('<a href="there.html">a</a><a href="#x">b</a><img src="gone/a.png">')
    assert dead(tmp_path / "page.html") == ["gone/a.png"]
