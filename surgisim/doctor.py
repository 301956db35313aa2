"""What this machine and this project have, and what that means for a run."""

import importlib.metadata
import os
import platform
import shutil
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from rich.console import Console
from rich.markup import escape

from surgisim.config.base import parse
from surgisim.config.whole import Whole, is_path
from surgisim.launch import home
from surgisim.machine import GIB, graphics, memory, processor
from surgisim.order import chosen
from surgisim.perception.optical_flow.choice import AUTO
from surgisim.problem import Problem
from surgisim.side_by_side import together
from surgisim.weights import KINDS, Kind, found

PACKAGES = ("surgisim", "snakemake", "numpy", "numba", "torch", "warp-lang", "opencv-python-headless", "av")
OPTIONAL = {
    "onnxruntime": "no learned masks (SAM 2)",
    "transformers": "no learned depth (Depth Anything v2)",
    "gsplat": "scenes are fitted and drawn on the CPU; --profile gpu wants it (extra 'cuda')",
    "snakemake-executor-plugin-slurm": "no --profile slurm",
}

Row = tuple[str, str, str]
"""What was looked at, what was found, what it means."""


def examine(configs: tuple[Path, ...]) -> None:
    """Print what was found; weights are looked for where `configs` say."""
    console = Console(highlight=False, soft_wrap=True)
    settings = parse(Whole, chosen(configs, ()), "config")
    there = found(settings.weights) if settings.weights else {}
    for name, what, means in (
        *_machine(),
        *_accelerators(),
        *_software(),
        *_weights(settings, there),
        *_used(settings, there),
    ):
        console.print(f"[bold]{name:24s}[/] {escape(what)}{f'  ({escape(means)})' if means else ''}")


def laws() -> None:
    """Print every law of the catalogue."""
    from surgisim.physics.catalogue import catalogue

    console = Console(highlight=False, soft_wrap=True)
    for name, term in catalogue().items():
        first = (term.about or "").strip().split("\n\n")[0].replace("\n", " ")
        console.print(f"[bold]{name}[/]  enters as {term.enters}. {first}")
        for param, p in term.params.items():
            off = "" if p.off is None else f", off at {p.off:g}"
            unit = "" if p.unit == "1" else f" {p.unit}"
            console.print(f"    {param:8s} {p.low:g} to {p.high:g}{unit}, {p.default:g} unless fitted{off}")


def _machine() -> Iterator[Row]:
    cores = len(os.sched_getaffinity(0))
    yield "processor", f"{processor()}, {cores} cores", "" if cores > 1 else "one core: expect twice the time"
    total, free = memory()
    means = "enough" if free >= 6 else "enough for the embedded clip" if free >= 4 else "too little: 4 GB are wanted"
    yield "memory", f"{total:.1f} GB, {free:.1f} GB free", means
    disk = shutil.disk_usage(Path.cwd()).free / GIB
    yield "disk here", f"{disk:.1f} GB free", "enough" if disk > 2 else "little: a clip's results take up to 1 GB"
    lacking = "" if together() else "work is done one piece at a time: install libgomp1"
    yield "OpenMP", "there" if not lacking else "none", lacking
    good = sys.version_info >= (3, 11)
    yield "python", f"{platform.python_version()} in {sys.prefix}", "" if good else "too old: 3.11 is wanted"
    try:
        yield "graph", str(home()), ""
    except Problem as problem:
        yield "graph", "none", str(problem)


def _accelerators() -> Iterator[Row]:
    import torch
    import warp

    cards = graphics()
    yield "GPU", ", ".join(cards) or "none", "use --profile gpu" if cards else "everything runs on the processor"
    usable = torch.cuda.is_available()
    build = "with CUDA" if torch.version.cuda else "for processors only"
    yield "torch", f"{torch.__version__}, built {build}", _matched(bool(cards), usable, "install a CUDA build of torch")
    warp.config.quiet, warp.config.log_level = True, 40
    warp.init()
    devices = [str(d) for d in warp.get_devices()]
    found = any(d.startswith("cuda") for d in devices)
    yield "warp", f"{warp.__version__}, sees {', '.join(devices)}", _matched(bool(cards), found, "check the driver")


def _matched(card: bool, usable: bool, cure: str) -> str:
    return "" if card == usable else f"a GPU is there and cannot be used: {cure}" if card else "a GPU answers"


def _software() -> Iterator[Row]:
    def version(name: str) -> str | None:
        try:
            return importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            return None

    yield "versions", ", ".join(f"{name} {version(name) or 'missing'}" for name in PACKAGES), ""
    for name, without in OPTIONAL.items():
        found = version(name)
        yield name, found or "not installed", "" if found else without
    container = shutil.which("apptainer") or shutil.which("singularity")
    yield "apptainer", container or "not installed", "" if container else "no --sdm apptainer; nothing else needs it"


def _weights(settings: BaseModel, there: Mapping[str, Path], prefix: str = "") -> Iterator[Row]:
    """Every setting that names a file; there: what the folder of weights holds for it."""
    for name, field in type(settings).model_fields.items():
        value: Any = getattr(settings, name)
        if isinstance(value, BaseModel):
            yield from _weights(value, there, f"{prefix}{name}.")
        elif is_path(field):
            key = f"{prefix}{name}"
            if not value and key in there:
                yield key, str(there[key]), _with(key)
            elif not value or str(value) == ".":
                yield key, "not set", _without(key)
            elif Path(value).exists():
                yield key, str(value), "found"
            else:
                yield key, str(value), "no such file: a run that needs it will stop there"


def _with(key: str) -> str:
    kind = next(kind for kind in KINDS if kind.setting == key)
    return f"brings {kind.brings}{_asks(kind)}"


def _asks(kind: Kind) -> str:
    if kind.asked_by is None:
        return ""
    stage, (key, choice) = kind.setting.split(".")[0], kind.asked_by
    also = f", and by auto with {stage}.{kind.auto_with}" if kind.auto_with else ""
    return f"; asked for by {stage}.{key}: {choice}{also}"


def _used(settings: Any, there: Mapping[str, Path]) -> Iterator[Row]:
    """What the settings' choices come to with the weights that are there."""
    masking = settings.masking
    lacks = [k for k in ("encoder", "decoder") if not (getattr(masking, k) or f"masking.{k}" in there)]
    if masking.backend != "auto":
        yield "masking uses", masking.backend, ""
    elif lacks:
        yield "masking uses", "colour_motion", f"given masks go before; sam2 lacks its {' and '.join(lacks)}"
    elif any(click.label == "tool" for click in masking.clicks):
        yield "masking uses", "sam2", "given masks go before"
    else:
        yield "masking uses", "colour_motion", "given masks go before; sam2 where instruments are clicked"
    for stage in ("correspondence", "inpainting"):
        name = getattr(settings, stage).flow
        yield f"{stage} uses", AUTO if name == "auto" else name, "optical flow"


def _without(key: str) -> str:
    if key.startswith("containers."):
        return "no --sdm apptainer; nothing else needs it"
    brings = next((kind.brings for kind in KINDS if kind.setting == key), None)
    return f"would bring {brings}" if brings else "left out, or done by the built-in method"
