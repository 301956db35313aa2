"""Which cases there are, and which of them can be measured here."""

import ast
import os
from dataclasses import dataclass
from pathlib import Path

from surgisim.problem import Problem

HERE = Path(__file__).parent
VARIABLE = "SURGISIM_DATA"


class Absent(Problem):
    """Data that a case needs are not here: it is left out, the others go on."""


@dataclass(frozen=True)
class Case:
    name: str
    title: str
    data: str | None
    """Folder below SURGISIM_DATA that it needs."""


def cases() -> dict[str, Case]:
    """Every case by name, in the order of names; read from the files without importing them."""
    # Importing would load Warp and every law only to list names, which the workflow does at each start.
    found = {}
    for path in sorted(HERE.glob("*.py")):
        told = _constants(path)
        if "TITLE" in told:
            found[path.stem] = Case(path.stem, told["TITLE"], told.get("DATA"))
    return found


def choose(names: list[str]) -> dict[str, Case]:
    """The cases asked for; all where none is named."""
    known = cases()
    missing = [n for n in names if n not in known]
    if missing:
        raise Problem(f"verification: no case is called {missing}; there are {sorted(known)}. Correct the name.")
    return {n: known[n] for n in names} or known


def data(folder: str) -> Path:
    """Where the data called `folder` lie; raises Absent, in one sentence, where they do not."""
    root = os.environ.get(VARIABLE, "")
    place = Path(root) / folder
    if not root:
        raise Absent(f"data '{folder}' are wanted, but {VARIABLE} is not set; set it to the folder that holds them.")
    if not place.is_dir():
        raise Absent(f"data '{folder}' are wanted, but {VARIABLE} holds no such folder; put them there.")
    return place


def absence(case: Case) -> str | None:
    """Why a case cannot be measured here; None where it can."""
    if case.data is None:
        return None
    try:
        data(case.data)
    except Absent as absent:
        return str(absent)
    return None


def _constants(path: Path) -> dict[str, str]:
    """Strings assigned to a name at the top of a module."""
    told = {}
    for node in ast.parse(path.read_text(), str(path)).body:
        target = node.targets[0] if isinstance(node, ast.Assign) else getattr(node, "target", None)
        value = getattr(node, "value", None)
        if isinstance(target, ast.Name) and isinstance(value, ast.Constant) and isinstance(value.value, str):
            told[target.id] = value.value
    return told
