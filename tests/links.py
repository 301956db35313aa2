"""Addresses on pages that lead nowhere."""

import re
from pathlib import Path

ADDRESS = re.compile(r"""(?:href|src)="([^"#]+)""")


def dead(page: Path) -> list[str]:
    """Relative addresses on a page that lead nowhere."""
    addresses = ADDRESS.findall(page.read_text())
    near = [a for a in addresses if not a.startswith(("data:", "http:", "https:"))]
    return [a for a in near if not (page.parent / a).exists()]
