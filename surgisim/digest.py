"""Which code a stage runs, as one digest: an edit reruns the stages that import the edited file.

Followed without importing anything: every `import` in a file, inside functions too, as far as it
stays in this project. A folder that is imported as a whole (`from surgisim.physics import terms`,
to be scanned), or named in a string (`import_module(f"surgisim.physics.terms.{name}")`), counts
with everything in it. Files beside the modules that are no Python (page templates) count too.
"""

import ast
import functools
import hashlib
from collections.abc import Iterator
from pathlib import Path

PACKAGE = "surgisim"


def digest(script: Path, root: Path) -> str:
    """16 hex digits over the content of everything `script` can run from the project in `root`."""
    total = hashlib.sha256()
    for path in sources(script, root):
        total.update(f"{path.relative_to(root)}\n".encode())
        total.update(_content(path))
    return total.hexdigest()[:16]


def sources(script: Path, root: Path) -> list[Path]:
    """Those files, sorted, the script included."""
    found: set[Path] = set()
    waiting = [script]
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            waiting += _mentioned(path, root)
    folders = {path.parent for path in found if path != script}
    data = {f for folder in folders for f in folder.iterdir() if f.is_file() and f.suffix not in (".py", ".pyc")}
    return sorted(found | data)


@functools.cache
def _content(path: Path) -> bytes:
    return path.read_bytes()


@functools.cache
def _mentioned(path: Path, root: Path) -> list[Path]:
    if path.suffix != ".py":
        return []
    tree = ast.parse(_content(path), str(path))
    return [file for name in _names(tree, path, root) for file in _files(name, root)]


def _names(tree: ast.AST, path: Path, root: Path) -> Iterator[str]:
    """Dotted names of this project in a file; one that ends in '.*' means the whole folder."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (f"{a.name}.*" for a in node.names if _ours(a.name))
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                here = path.relative_to(root).parent.parts
                base = ".".join([*here[: len(here) - node.level + 1], *([base] if base else [])])
            if _ours(base):
                yield base
                yield from (f"{base}.{a.name}.*" for a in node.names)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.startswith(f"{PACKAGE}."):
            yield f"{node.value.rstrip('.')}.*"


def _ours(name: str) -> bool:
    return name.split(".")[0] == PACKAGE


def _files(name: str, root: Path) -> Iterator[Path]:
    """The module of that name and the `__init__` of every folder above it."""
    whole = name.endswith(".*")
    parts = name.removesuffix(".*").split(".")
    if not all(part.isidentifier() for part in parts):
        return
    for depth in range(1, len(parts) + 1):
        place = root.joinpath(*parts[:depth])
        if (place / "__init__.py").is_file():
            yield place / "__init__.py"
        if place.with_suffix(".py").is_file():
            yield place.with_suffix(".py")
    if whole and place.is_dir() and depth > 1:
        yield from place.rglob("*.py")
