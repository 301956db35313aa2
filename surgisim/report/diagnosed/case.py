"""What the page shows, together."""

import json
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from surgisim.artifacts.base import load
from surgisim.artifacts.mismatch import Mismatch
from surgisim.artifacts.verdict import PULLED, Marker, Verdict, read_verdict
from surgisim.problem import Problem
from surgisim.recordings.folder import read_recording
from surgisim.recordings.recording import Recording
from surgisim.report.made import Made, made


@dataclass(frozen=True)
class Diagnosed:
    recording: Recording
    verdict: Verdict
    mismatch: Mismatch
    physics: dict[str, Any]
    """physics.json as it stands."""
    experiment: dict[str, Any] = field(default_factory=dict)
    """"center" and "pull" [m] of the separating experiment, where the diagnosis gives them."""
    elsewhere: dict[str, Any] = field(default_factory=dict)
    """The base that another recording told, where there is one: file, numbers, passed_over."""
    header: dict[str, Any] = field(default_factory=dict)
    """Of diagnosis.json, where this project wrote it: settings and digest of the code."""

    def made(self) -> Made:
        """How the diagnosis was made, and by what its page is."""
        return made({"diagnosis": self.header.get("settings", {})}, {"diagnosis": self.header.get("code", "not known")})

    @property
    def shown(self) -> tuple[Marker, ...]:
        """Places that the words name: effects by number, the largest misfit by its letter."""
        return self.verdict.markers

    @property
    def markers(self) -> tuple[Marker, ...]:
        """The same, and where the separating experiment takes hold."""
        if not self.experiment:
            return self.shown
        x, y, z = (float(c) for c in self.experiment["center"])
        return (*self.shown, Marker(PULLED, "the pull that would decide", (x, y, z)))

    @property
    def time(self) -> np.ndarray:
        """[s], (T,)"""
        return np.arange(self.recording.frames) / self.recording.fps

    @property
    def phase(self) -> np.ndarray:
        """What goes on in each frame, (T,) words."""
        return np.array(("rest", "load", "hold", "released"))[self.mismatch.phase]

    @property
    def split(self) -> np.ndarray:
        """0 where a frame could be fitted, 2 where it was held out, (T,)."""
        held = np.zeros(self.recording.frames, int)
        first, last = self.recording.held_out
        held[first:last] = 2
        return held

    @property
    def grasped_anew(self) -> bool:
        """Whether tissue is taken hold of in the frames held out."""
        first, last = self.recording.held_out
        active = self.recording.motion.active
        return bool((active[:, 1:] & ~active[:, :-1])[:, max(0, first - 1) : last].any())

    @property
    def up(self) -> np.ndarray:
        """Against gravity, or from the body's middle to the points that are seen, (3,)."""
        if self.recording.gravity is not None and np.linalg.norm(self.recording.gravity) > 0:
            away = -np.array(self.recording.gravity)
        else:
            away = self.mismatch.points.mean(0) - self.mismatch.particles.mean(0)
        return away / max(float(np.linalg.norm(away)), 1e-12)


def read(recording: Path, diagnosis: Path, mismatch: Path, physics: Path) -> Diagnosed:
    """Everything that the page shows. Raises Problem for files that are not of one diagnosis."""
    clip, verdict, left = read_recording(recording), read_verdict(diagnosis), load(Mismatch, mismatch)
    if verdict.recording != clip.name or len(left.phase) != clip.frames:
        raise Problem(
            f"{diagnosis}: is of recording {verdict.recording} with {len(left.phase)} frames in {mismatch.name}, but "
            f"{recording} is {clip.name} with {clip.frames}. Pass files of one diagnosis."
        )
    if verdict.goodness and len(verdict.goodness.per_frame) > clip.frames:
        raise Problem(
            f"{diagnosis}: its goodness has {len(verdict.goodness.per_frame)} frames, but the recording has "
            f"{clip.frames}. Diagnose anew."
        )
    told = json.loads(diagnosis.read_text())
    return Diagnosed(
        clip,
        verdict,
        left,
        json.loads(physics.read_text()),
        told.get("experiment") or _pull(verdict),
        told.get("elsewhere") or {},
        told.get("header", {}),
    )


PULL = re.compile(r"(?:near|at \w+) \(([-\d., ]+?)(?:\) mm| mm\)), pull ([\d.]+) mm .*?along \(([-\d., ]+)\)")
"""How a diagnosis words a pull."""


def _pull(verdict: Verdict) -> dict[str, Any]:
    """Where the first separating experiment takes hold and how it pulls, from its words."""
    for effect in verdict.effects:
        found = PULL.search(effect.separating_experiment)
        if found:
            center, way = (np.array([float(x) for x in found[k].split(",")]) for k in (1, 3))
            return {"center": 1e-3 * center, "pull": 1e-3 * float(found[2]) * way}
    return {}
