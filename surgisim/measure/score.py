"""All numbers of a run."""

from typing import Any

from surgisim.measure.groups.depth import depth
from surgisim.measure.groups.grasp import grasp
from surgisim.measure.groups.inpainting import inpainting
from surgisim.measure.groups.masking import masking
from surgisim.measure.groups.physics import physics
from surgisim.measure.groups.reconstruction import reconstruction
from surgisim.measure.groups.replay import replay
from surgisim.measure.groups.simulation import simulation
from surgisim.measure.groups.tracking import tracking
from surgisim.measure.lpips import Lpips
from surgisim.measure.number import measured
from surgisim.measure.run import Run


def score(run: Run, *, lpips: Lpips | None, first: int, progress=lambda *_: None) -> dict[str, dict[str, Any]]:
    """Group -> name -> {"value", "unit", "protocol"[, "series"]}; see `number` for what is missing."""
    asked = {
        "masking": lambda: masking(run),
        "inpainting": lambda: inpainting(run),
        "depth": lambda: depth(run),
        "tracking": lambda: tracking(run),
        "grasp": lambda: grasp(run),
        "reconstruction": lambda: reconstruction(run, lpips, first),
        "simulation": lambda: simulation(run, lpips),
        "replay": lambda: replay(run),
        "physics": lambda: physics(run),
    }
    groups = {}
    for done, (name, ask) in enumerate(asked.items()):
        progress(done, len(asked), name)
        groups[name] = ask()
    progress(len(asked), len(asked), "measured")
    return measured(groups)
