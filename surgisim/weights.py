"""Networks' weights, found by their names in one folder: `weights:` in the config.

What a setting of its own names wins. Only what a run uses is put into its settings: a file that is laid there for
something else makes no stage run again.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from surgisim.problem import Problem


@dataclass(frozen=True)
class Kind:
    setting: str
    """Which names it where none is found: stage.key."""
    pattern: str
    """Names that it has, as globs; a folder's too."""
    brings: str
    asked_by: tuple[str, str] | None
    """Key of the stage's settings that asks for it, and the choice that does; none where it is read whenever it is
    there."""
    auto_with: str | None = None
    """Key of the stage's settings with which `auto` asks for it, too: what docs/benchmarks/learned.md shows better."""


SAM2 = ("backend", "sam2")
KINDS = (
    Kind(
        "masking.encoder",
        "sam2*encoder*.onnx",
        "outlines of instruments, with its decoder",
        ("backend", "sam2"),
        "clicks",
    ),
    Kind(
        "masking.decoder",
        "sam2*decoder*.onnx",
        "outlines of instruments, with its encoder",
        ("backend", "sam2"),
        "clicks",
    ),
    Kind("inpainting.flow_weights", "raft*.safetensors", "optical flow behind instruments by RAFT", ("flow", "raft")),
    Kind("inpainting.weights", "inpaint*", "what instruments hide, painted by a network", ("backend", "network")),
    Kind("correspondence.flow_weights", "raft*.safetensors", "tissue that went far found by RAFT", ("flow", "raft")),
    Kind("depth.weights", "depth_anything*", "depth of single frames by a network", ("backend", "depth_anything")),
    Kind(
        "tracking.weights",
        "cotracker*.pt",
        "tissue points through a clip followed by a network",
        ("backend", "cotracker"),
    ),
    Kind("evaluation.lpips_weights", "lpips*.safetensors", "LPIPS beside PSNR and SSIM in reports and tables", None),
)


def found(folder: Path) -> dict[str, Path]:
    """Setting -> what lies in the folder for it. Raises Problem where there is no such folder, or two files for one."""
    if not folder.is_dir():
        raise Problem(f"config key 'weights': {folder} is no folder. Name one that holds networks' weights, or none.")
    result = {}
    for kind in KINDS:
        there = sorted(folder.glob(kind.pattern))
        if len(there) > 1:
            names = ", ".join(path.name for path in there)
            raise Problem(
                f"config key 'weights': {folder} holds {names}, all for {kind.setting}. Leave one, or name one there."
            )
        if there:
            result[kind.setting] = there[0].absolute()
    return result


def filled(raw: Mapping[str, Any], there: Mapping[str, Path]) -> dict[str, Any]:
    """Settings with what was found where they name nothing."""
    result = dict(raw)
    for kind in KINDS:
        stage, key = kind.setting.split(".")
        own = result.get(stage) or {}
        if kind.setting in there and not own.get(key) and _is_asked_for(kind, own):
            result[stage] = {**own, key: str(there[kind.setting])}
    return result


def _is_asked_for(kind: Kind, own: Mapping[str, Any]) -> bool:
    if kind.asked_by is None:
        return True
    key, choice = kind.asked_by
    told = own.get(key, "auto" if kind.auto_with else None)
    return told == choice or bool(told == "auto" and kind.auto_with and own.get(kind.auto_with))
