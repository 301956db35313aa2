"""The phantom shares no code with what it is used to test."""

import ast
from pathlib import Path

ROOM = Path(__file__).parents[2] / "surgisim" / "phantom"
ALLOWED = (
    "surgisim.phantom",
    "surgisim.artifacts",
    "surgisim.config.phantom",
    "surgisim.config.invent",
    "surgisim.problem",
)


def imports(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name} imports relatively"
            yield node.module if node.module != "surgisim" else f"surgisim.{node.names[0].name}"


def test_the_phantom_imports_nothing_that_it_is_used_to_test():
    files = sorted(ROOM.rglob("*.py"))
    assert files
    for path in files:
        foreign = [m for m in imports(path) if m.split(".")[0] == "surgisim" and not m.startswith(ALLOWED)]
        assert not foreign, f"{path.name} imports {foreign}"
        engines = [m for m in imports(path) if m.split(".")[0] in ("torch", "warp", "gsplat")]
        assert not engines, f"{path.name} imports {engines}"
