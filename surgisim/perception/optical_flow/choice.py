"""The optical flow that a stage's settings ask for."""

import importlib
import pkgutil
from pathlib import Path

from surgisim.perception import optical_flow
from surgisim.perception.optical_flow import Flow
from surgisim.problem import Problem

AUTO = "dis"
"""What `auto` takes, with weights or without: docs/benchmarks/learned.md."""


def chosen(name: str, weights: Path | None, *, stage: str) -> Flow:
    """The backend of that name, with its weights loaded; `stage` is whose settings named it."""
    name = AUTO if name == "auto" else name
    known = sorted(m.name for m in pkgutil.iter_modules(optical_flow.__path__) if m.name != "choice")
    if name not in known:
        raise Problem(
            f"config key '{stage}.flow' is '{name}', and surgisim/perception/optical_flow/ holds {known}. Choose one "
            "of them, or auto."
        )
    module = importlib.import_module(f"{optical_flow.__name__}.{name}")
    return module.prepared(weights)
