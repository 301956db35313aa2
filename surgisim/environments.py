"""What each family of stages needs, pinned: envs/FAMILY.yaml for conda, envs/FAMILY.Dockerfile and .txt for images.

Which stages a family has, the rules say (`conda:`); what they import is read from their code, what that needs in turn
from the packages themselves, and every version from the one lock, requirements.txt. So nothing is listed twice, and
`python -m surgisim.environments FOLDER` (part of `make config`) writes it anew.
"""

import ast
import re
import sys
from functools import cache
from importlib.metadata import PackageNotFoundError, packages_distributions, requires
from pathlib import Path

from packaging.markers import Marker
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from surgisim.digest import PACKAGE, sources

FAMILIES = {
    "perception": "The pixels: ingest to tracking.",
    "scene": "The moving scene and the body: reconstruction, thickening.",
    "physics": "The phantom, the fit, the simulation and the diagnosis.",
    "report": "Numbers and pages: evaluation, reports, tables and boards.",
}
"""Family -> what it is for."""
EVERY = "every"
"""All of them at once: one environment, or one image, for whoever wants no four."""
PYTHON = "3.11"
"""Version that conda's environments have; images have their base's."""
THERE = {
    "python_version": PYTHON,
    "python_full_version": f"{PYTHON}.9",
    "sys_platform": "linux",
    "platform_machine": "x86_64",
    "platform_system": "Linux",
    "implementation_name": "cpython",
    "platform_python_implementation": "CPython",
    "os_name": "posix",
    "extra": "",
}
"""Where conda's environments are made, as markers ask for it."""
RULE = re.compile(r"^rule \w+:\n((?:(?:[ ]{4}.*)?\n)*)", re.MULTILINE)


def scripts(family: str, root: Path) -> list[Path]:
    """Files that jobs of the family run."""
    if family == EVERY:
        return sorted({path for each in FAMILIES for path in scripts(each, root)})
    found = set()
    for rules in sorted((root / "workflow" / "rules").glob("*.smk")):
        for body in RULE.findall(rules.read_text()):
            if f"envs/{family}.yaml" in body:
                found |= {root / "stages" / f"{name}.py" for name in re.findall(r"stages/(\w+)\.py", body)}
                modules = (root.joinpath(*name.split(".")) for name in re.findall(rf"-m ({PACKAGE}[\w.]*)", body))
                found |= {m / "__main__.py" if m.is_dir() else m.with_suffix(".py") for m in modules}
    return sorted(found)


def needed(family: str, root: Path) -> list[str]:
    """Packages of the lock that the family's code imports, and what those need, by their names there."""
    locked, waiting, found = lock(root), _imported(family, root), set()
    while waiting:
        name = waiting.pop()
        if name in found or name not in locked:
            continue
        found.add(name)
        waiting |= _asked(name)
    return sorted(found)


@cache
def lock(root: Path) -> dict[str, list[str]]:
    """Package -> its entries in requirements.txt, one for each Python that has its own; torch's from envs/setup.sh."""
    entries: dict[str, list[str]] = {}
    for entry in re.findall(r"^[a-z0-9][^\n]*(?:\n    --hash[^\n]*)*", (root / "requirements.txt").read_text(), re.M):
        entries.setdefault(canonicalize_name(re.split("[=; ]", entry)[0]), []).append(entry)
    torch = re.search(r"TORCH:-(torch==[\w.+]+)", (root / "envs" / "setup.sh").read_text())
    assert torch, "envs/setup.sh names no torch"
    return entries | {"torch": [torch[1]]}


def for_conda(family: str, root: Path) -> str:
    """Content of envs/FAMILY.yaml."""
    pins = [
        entry.split(" ;")[0].split(" \\")[0]
        for name in needed(family, root)
        for entry in lock(root)[name]
        if _holds(entry)
    ]
    lines = [f"# {_purpose(family)} Written by `make config` from the lock.", "channels:", "  - conda-forge"]
    lines += ["  - nodefaults", "dependencies:", f"  - python={PYTHON}", "  - pip", "  - pip:"]
    return "\n".join([*lines, *(f"      - {pin}" for pin in pins)]) + "\n"


def for_images(family: str, root: Path) -> str:
    """Content of envs/FAMILY.txt: entries of the lock as they are, but torch, whose build each image chooses."""
    head = f"# {_purpose(family)} Written by `make config` from the lock; torch comes on top.\n"
    return head + "".join(f"{e}\n" for n in needed(family, root) if n != "torch" for e in lock(root)[n])


def image(family: str, root: Path) -> str:
    """Content of envs/FAMILY.Dockerfile."""
    (torch,) = lock(root)["torch"]
    return f"""\
# {_purpose(family)} Written by `make config`. Build from the checkout: docker build -f envs/{family}.Dockerfile .
# The checkout itself is not in it: jobs have it bound, so an edit makes no image stale.
ARG BASE=python:{PYTHON}-slim-bookworm
FROM ${{BASE}}
# TORCH may name a build, "{torch} --index-url https://download.pytorch.org/whl/cpu"; EXTRA adds what a GPU serves,
# gsplat==1.5.3.
ARG TORCH={torch}
ARG EXTRA=
# Threads of numba's loops; its own pool ends a process in which two of them meet.
RUN apt-get update && apt-get install -y --no-install-recommends libgomp1 && rm -rf /var/lib/apt/lists/*
COPY envs/{family}.txt /tmp/
RUN pip install --no-cache-dir --require-hashes --no-deps -r /tmp/{family}.txt \\
 && pip install --no-cache-dir ${{TORCH}} ${{EXTRA}} \\
 && rm /tmp/{family}.txt
"""


def _imported(family: str, root: Path) -> set[str]:
    modules = set()
    for script in scripts(family, root):
        for path in sources(script, root):
            if path.suffix == ".py":
                modules |= third_parties(path)
    known = packages_distributions()
    return {canonicalize_name(package) for module in modules for package in known.get(module, [])}


@cache
def third_parties(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text(), str(path))):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
            found.add(node.module.split(".")[0])
    return found - {PACKAGE} - sys.stdlib_module_names


def _asked(name: str) -> set[str]:
    try:
        told = [Requirement(text) for text in requires(name) or ()]
    except PackageNotFoundError:
        return set()
    return {canonicalize_name(r.name) for r in told if r.marker is None or r.marker.evaluate(THERE)}


def _holds(entry: str) -> bool:
    marker = entry.split("\n")[0].removesuffix(" \\").partition(" ; ")[2]
    return not marker or Marker(marker).evaluate(THERE)


def main(folder: Path) -> None:
    root = Path(__file__).resolve().parents[1]
    for name, content in written(root).items():
        (folder / name).write_text(content)


def _purpose(family: str) -> str:
    return FAMILIES.get(family, "All stages.")


def written(root: Path) -> dict[str, str]:
    """File in envs/ -> its content."""
    forms = {".yaml": for_conda, ".txt": for_images, ".Dockerfile": image}
    return {f"{family}{suffix}": form(family, root) for family in (*FAMILIES, EVERY) for suffix, form in forms.items()}


if __name__ == "__main__":
    main(Path(sys.argv[1]))
