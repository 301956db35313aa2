"""All numbers of a run."""

from typing import Any

from surgisim.measure.groups.depth import depth
from surgisim.measure.groups.depth_change import depth_change
from surgisim.measure.groups.grasp import grasp
from surgisim.measure.groups.grip_path import grip_path
from surgisim.measure.groups.inpainting import inpainting
from surgisim.measure.groups.masking import masking
from surgisim.measure.groups.perception_by_phase import (
    masking_by_phase,
    reconstruction_by_phase,
    tracking_by_phase,
)
from surgisim.measure.groups.physics import physics
from surgisim.measure.groups.reconstruction import reconstruction
from surgisim.measure.groups.replay import replay
from surgisim.measure.groups.scene_geometry import scene_geometry
from surgisim.measure.groups.simulation import simulation
from surgisim.measure.groups.simulation_by_phase import simulation_by_phase
from surgisim.measure.groups.tracking import tracking
from surgisim.measure.lpips import Lpips
from surgisim.measure.number import measured, number
from surgisim.measure.run import OfScene, Run
from surgisim.side_by_side import in_order


def score(run: Run, *, lpips: Lpips | None, first: int, progress=lambda *_: None) -> dict[str, dict[str, Any]]:
    """Group -> name -> {"value", "unit", "protocol"[, "series"]}; see `number` for what is missing."""
    asked = {
        "masking": lambda: masking(run) | masking_by_phase(run),
        "inpainting": lambda: inpainting(run),
        "depth": lambda: depth(run) | depth_change(run),
        "tracking": lambda: tracking(run) | tracking_by_phase(run),
        "grasp": lambda: grasp(run) | grip_path(run),
        "reconstruction": lambda: reconstruction(run, lpips, first) | reconstruction_by_phase(run),
        "scene": lambda: scene_geometry(run),
        "simulation": lambda: simulation(run, lpips) | simulation_by_phase(run),
        "replay": lambda: replay(run),
        "physics": lambda: physics(run),
    }
    groups = {}
    progress(0, len(asked), "measuring")
    for name, found in zip(asked, in_order(lambda ask: ask(), zip(asked.values())), strict=True):
        groups[name] = found
        progress(len(groups), len(asked), f"{name} measured")
    return measured(groups)


def score_scene(made: OfScene, *, lpips: Lpips | None, first: int, seed: int) -> dict[str, dict[str, Any]]:
    """The numbers of a scene alone, and the seed it was fitted with."""
    own = reconstruction(made, lpips, first) | {"seed": number(seed, "1", "seed of the fit")}
    return measured({"reconstruction": own, "scene": scene_geometry(made)})
