"""No file that somebody hands over is executed: nothing in the code unpickles, evaluates, unpacks or downloads."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FILES = sorted(p for room in ("surgisim", "stages", "workflow") for p in (ROOT / room).rglob("*.py"))
MODULES = {"pickle", "cPickle", "_pickle", "dill", "cloudpickle", "joblib", "shelve", "marshal", "tarfile"}
BUILTINS = {"eval", "exec", "compile", "__import__"}
CALLS = {
    "yaml.load": "yaml.safe_load reads data and nothing else",
    "yaml.load_all": "yaml.safe_load_all reads data and nothing else",
    "yaml.full_load": "yaml.safe_load reads data and nothing else",
    "yaml.unsafe_load": "yaml.safe_load reads data and nothing else",
    "os.system": "subprocess.run takes a list, which no shell reads",
    "os.popen": "subprocess.run takes a list, which no shell reads",
    "torch.hub.load": "weights are files, and nothing is downloaded",
    "np.fromfile": "numpy.load checks what a file says of itself",
    "pandas.read_pickle": "a pickle executes what it holds",
}
METHODS = {"extractall": "archives are read, and never unpacked"}
WANTED = {
    "torch.load": ("weights_only", True),
    "Image.open": ("formats", None),
}
"""Calls that need an argument, and the value that it must have (None: any)."""


def dotted(node: ast.expr) -> str:
    return f"{dotted(node.value)}.{node.attr}" if isinstance(node, ast.Attribute) else getattr(node, "id", "")


def faults(source: str) -> Iterator[str]:
    """What in a file's code could execute what it reads, in words."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else [node.module or ""]
            yield from (f"line {node.lineno}: imports {n}" for n in names if n.split(".")[0] in MODULES)
        if not isinstance(node, ast.Call):
            continue
        name, told = dotted(node.func), {k.arg: getattr(k.value, "value", ...) for k in node.keywords}
        reason = CALLS.get(name) or METHODS.get(name.rpartition(".")[2])
        if isinstance(node.func, ast.Name) and name in BUILTINS:
            reason = "text that somebody wrote is not run"
        if name in WANTED:
            argument, value = WANTED[name]
            if argument not in told or (value is not None and told[argument] is not value):
                reason = f"it wants {argument}={'...' if value is None else value}"
        if told.get("allow_pickle", False) is not False:
            reason = "a pickled array executes what it holds"
        if told.get("shell", False) is not False:
            reason = "a list of words is read by no shell"
        if told.get("trust_remote_code", False) is not False:
            reason = "code that comes with weights is not run"
        if name.endswith(".from_pretrained") and told.get("local_files_only") is not True:
            reason = "nothing is downloaded"
        if reason:
            yield f"line {node.lineno}: {name}: {reason}"


def test_no_code_executes_what_it_reads():
    assert len(FILES) > 300
    found = [f"{path.relative_to(ROOT)}, {fault}" for path in FILES for fault in faults(path.read_text())]
    assert not found, found


@pytest.mark.parametrize(
    "line",
    [
        "import pickle",
        "from joblib import load",
        "import torch\ntorch.load(path)",
        "import torch\ntorch.load(path, weights_only=False)",
        "import numpy as np\nnp.load(path, allow_pickle=True)",
        "import numpy as np\nnp.load(path, allow_pickle=chosen)",
        "import yaml\nyaml.load(text, Loader=yaml.Loader)",
        "eval(text)",
        "archive.extractall(folder)",
        "Image.open(path)",
        "Model.from_pretrained(name)",
        "subprocess.run(text, shell=True)",
    ],
)
def test_what_would_execute_is_found(line):
    assert list(faults(line))
    assert not list(faults("import torch\ntorch.load(path, weights_only=True)\nmodel.eval()\nre.compile(word)"))
