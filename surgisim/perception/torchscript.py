"""Networks as TorchScript from a file: what is in it is looked at before anything of it is loaded.

A TorchScript file holds tensors, a program in a small language, and pickles that put them together. A pickle may name
any function to be called while it is read, and the program may write files. One that does either is refused, whatever
torch itself would make of it.
"""

import pickletools
import re
import zipfile
from collections.abc import Iterator
from pathlib import Path

from surgisim.problem import Problem

KNOWN = re.compile(
    r"__torch__[\w.]* \w+|torch \w+Storage|torch\._utils _rebuild_\w+|torch\.jit\._pickle \w+|collections OrderedDict"
)
"""What pickles of networks name, module and function: types of the program, tensors, and lists of plain values."""
WRITES = re.compile(r"\b(torch|ops\.aten)\.(save|from_file)\b|\bops\.(?!prim\b|aten\b)\w+\.\w+|\bIgnoredPythonOp\b")
"""What programs of networks have no need for: files, and operators that are not torch's own."""
LARGEST = 64 * 1024**2
"""Most bytes of a program or a pickle; tensors lie elsewhere."""


def torchscript(path: Path, *, export: str):
    """The network, ready to be asked. export: what to do where it cannot be loaded."""
    import torch

    if (found := next(_executes(path, export), None)) is not None:
        raise Problem(
            f"{path}: {found}, so that loading or running it would execute more than a network; nothing of it was "
            f"loaded. {export}"
        )
    try:
        return torch.jit.load(str(path), map_location="cpu").eval()
    except RuntimeError as error:
        first = str(error).strip().splitlines()[0]
        raise Problem(f"{path}: cannot be loaded as TorchScript ({first}). {export}") from error


def _executes(path: Path, export: str) -> Iterator[str]:
    """What in a file would call or write something, in words."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = [member.filename for member in archive.infolist()]
            if not any(name.endswith("/constants.pkl") for name in names):
                raise Problem(
                    f"{path}: is a pickle of Python objects (torch.save), which can execute anything while it is read, "
                    f"and not TorchScript; nothing of it was loaded. {export}"
                )
            for member in archive.infolist():
                if not member.filename.endswith((".pkl", ".py")):
                    continue
                if member.file_size > LARGEST:
                    yield f"'{member.filename}' in it has {member.file_size} bytes"
                elif member.filename.endswith(".py"):
                    if found := WRITES.search(archive.read(member).decode(errors="replace")):
                        yield f"'{member.filename}' in it uses '{found.group()}'"
                else:
                    strange = (name for name in _named(archive.read(member)) if not KNOWN.fullmatch(name))
                    yield from (f"'{member.filename}' in it calls '{name}'" for name in strange)
    except Problem:
        raise
    except (zipfile.BadZipFile, NotImplementedError, EOFError) as error:
        raise Problem(f"{path}: is no TorchScript file ({error}); nothing of it was loaded. {export}") from error
    except ValueError as error:
        raise Problem(f"{path}: holds a damaged pickle ({error}); nothing of it was loaded. {export}") from error


def _named(pickled: bytes) -> Iterator[str]:
    """Every function or type that a pickle names, 'module name'; read, not executed."""
    for operation, argument, _ in pickletools.genops(pickled):
        if operation.name in ("GLOBAL", "INST"):
            yield str(argument)
        elif operation.name in ("STACK_GLOBAL", "EXT1", "EXT2", "EXT4"):
            # torch writes none of these; what they name is made up while the pickle is read.
            yield operation.name
