"""A new manipulation as a small JSON a person writes, turned into grips, a moving base and a cut.

    {"seconds": 3.0,
     "do": [{"act": "pull", "at": [80, 60], "by": [0.002, 0, -0.008], "begin": 0.2, "end": 1.0},
            {"act": "release", "time": 1.6},
            {"act": "cut", "along": [[40, 60], [90, 60]], "depth": 0.006, "time": 0.1}]}

Places are pixels of the recording's first frame (two numbers) or points of the camera frame in metres (three);
displacements are metres of the camera frame (x right, y down, z away from the camera).
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field
from scipy.interpolate import PchipInterpolator

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.motion import Motion
from surgisim.config.base import Settings, parse
from surgisim.mpm.cut import Cut
from surgisim.problem import Problem

GRIP = 1.5
"""Radius of a grip that says none [grid spacing]."""
EARLY = 1e-9
"""Times that were rounded when they were written still mean their frame [s]."""
Place = tuple[float, float] | tuple[float, float, float]
Vector = tuple[float, float, float]


class Pull(Settings):
    """Take a ball of tissue and carry it smoothly."""

    act: Literal["pull"]
    at: Place
    by: Vector
    begin: float = Field(0.0, ge=0)
    end: float = Field(gt=0)
    radius: float | None = Field(None, gt=0)


class Push(Settings):
    """Press a ball of tissue away from the camera (or `by`), and let go at `until`."""

    act: Literal["push"]
    at: Place
    by: Vector
    begin: float = Field(0.0, ge=0)
    end: float = Field(gt=0)
    until: float | None = Field(None, gt=0)
    radius: float | None = Field(None, gt=0)


class Carry(Settings):
    """Take a ball of tissue and carry it along a path: what somebody did by hand in the viewer."""

    act: Literal["carry"]
    at: Place
    path: list[tuple[float, float, float, float]] = Field(min_length=2)
    """Time [s] and displacement along x, y and z [m]; between them it goes smoothly."""
    until: float | None = Field(None, gt=0)
    """When it is let go; none is the end, or a release [s]."""
    radius: float | None = Field(None, gt=0)

    @property
    def begin(self) -> float:
        return self.path[0][0]

    @property
    def end(self) -> float:
        return self.path[-1][0]


class Release(Settings):
    """Let go of everything that is held."""

    act: Literal["release"]
    time: float = Field(ge=0)


class Shake(Settings):
    """Move the boundary that does not move by itself, as a sine."""

    act: Literal["shake"]
    by: Vector
    frequency: float = Field(gt=0)
    begin: float = Field(0.0, ge=0)
    end: float = Field(gt=0)


class Slit(Settings):
    """Cut the surface along a line."""

    act: Literal["cut"]
    along: tuple[Place, Place]
    depth: float = Field(gt=0)
    time: float = Field(0.0, ge=0)


class Operation(Settings):
    """Everything that is done, in any order."""

    name: str = "operation"
    seconds: float = Field(gt=0, le=600)
    do: list[Annotated[Pull | Push | Carry | Release | Shake | Slit, Field(discriminator="act")]]


@dataclass(frozen=True)
class Plan:
    """What a simulation needs to know of an operation."""

    motion: Motion
    base: np.ndarray
    """Displacement of the held boundary at every frame [m], (T, 3)."""
    cut: Cut | None
    cut_frame: int


def plan(raw: dict[str, Any], rest: np.ndarray, surface: np.ndarray, camera: Camera, spacing: float) -> Plan:
    """Check an operation against the body and lay it out on frames.

    rest particles [m], (P, 3); surface (P,) bool marks those that the camera sees. A ball has a
    radius of 1.5 grid spacings unless given. Raises Problem for anything that cannot be done.
    """
    operation = parse(Operation, raw, "operation")
    frames = max(2, round(operation.seconds * camera.fps) + 1)
    clock = np.arange(frames) / camera.fps
    releases = sorted(a.time for a in operation.do if isinstance(a, Release))
    cuts = [a for a in operation.do if isinstance(a, Slit)]
    if len(cuts) > 1:
        raise Problem(f"operation: {len(cuts)} cuts are asked for, and one can be made in a simulation. Keep one.")
    top = rest[surface]
    centers, radii, positions, active = [], [], [], []
    base = np.zeros((frames, 3))
    for act in operation.do:
        if isinstance(act, Release):
            continue
        begin, end = (act.time, act.time) if isinstance(act, Slit) else (act.begin, act.end)
        if end < begin or end > operation.seconds or (end == begin and not isinstance(act, Slit)):
            raise Problem(
                f"operation: '{act.act}' runs from {begin} s to {end} s, but it must end after it begins and within "
                f"the {operation.seconds} s of the operation."
            )
        if isinstance(act, Shake):
            on = (clock >= begin) & (clock <= end)
            base += np.where(on, np.sin(2 * np.pi * act.frequency * (clock - begin)), 0.0)[:, None] * np.array(act.by)
        elif isinstance(act, Pull | Push | Carry):
            point = _point(act.at, top, camera, act.act)
            let_go = None if isinstance(act, Pull) else act.until
            until = min([t for t in [*releases, let_go] if t is not None and t > begin], default=np.inf)
            centers.append(point)
            radii.append(act.radius or GRIP * spacing)
            positions.append(point + _displacement(act, clock))
            active.append((clock >= begin - EARLY) & (clock <= until + EARLY))
    motion = Motion(
        center_rest=np.array(centers).reshape(-1, 3),
        radius=np.array(radii, float),
        position=np.array(positions).reshape(-1, frames, 3),
        active=np.array(active, bool).reshape(-1, frames),
        confidence=np.ones(len(radii)),
        source="given",
    )
    cut = None
    if cuts:
        begin, end = (_point(place, top, camera, "cut") for place in cuts[0].along)
        if np.linalg.norm(begin - end) < spacing:
            raise Problem("operation: the two ends of the cut are closer than a grid cell. Make the cut longer.")
        cut = Cut(begin, end, cuts[0].depth)
    frame = min(frames - 1, round(cuts[0].time * camera.fps)) if cuts else 0
    return Plan(motion, base, cut, frame)


def _displacement(act: Pull | Push | Carry, clock: np.ndarray) -> np.ndarray:
    """Of what is held, at times [s], (T,): [m], (T, 3)."""
    if isinstance(act, Carry):
        path = np.array(act.path)
        if (np.diff(path[:, 0]) <= 0).any():
            raise Problem("operation: the times of a 'carry' path must grow from one entry to the next. Sort them.")
        return PchipInterpolator(path[:, 0], path[:, 1:])(np.clip(clock, act.begin, act.end))
    s = np.clip((clock - act.begin) / (act.end - act.begin), 0, 1)
    return (s * s * (3 - 2 * s))[:, None] * np.array(act.by)


def _point(place: Place, top: np.ndarray, camera: Camera, act: str) -> np.ndarray:
    """A place on the tissue: as given, or where the pixel's ray meets the seen surface."""
    if len(place) == 3:
        return np.array(place, float)
    pixel = camera.from_recording(place)
    distance = np.linalg.norm(camera.project(top) - pixel, axis=1)
    near = np.argsort(distance, kind="stable")[:4]
    reach = 3 * np.sqrt(camera.width * camera.height / max(len(top), 1))
    if distance[near[0]] > max(reach, 4):
        raise Problem(
            f"operation: '{act}' at pixel {list(place)} of the recording meets no tissue; the nearest lies "
            f"{distance[near[0]] * camera.crop[2] / camera.width:.0f} px away. Choose a pixel of the first frame, "
            f"{camera.source_size[0]} x {camera.source_size[1]} px, that shows tissue."
        )
    return camera.lift(pixel, np.median(top[near, 2]))


def read_operation(path: Path) -> dict[str, Any]:
    """The JSON a person wrote; its content is checked by `plan`."""
    try:
        raw = json.loads(path.read_text())
    except FileNotFoundError as error:
        raise Problem(f"{path}: no such file, but an operation is wanted here (docs/operations.md).") from error
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise Problem(f"{path}: is not JSON ({error}). docs/operations.md shows one.") from error
    if not isinstance(raw, dict):
        raise Problem(f"{path}: holds a {type(raw).__name__}, but an object with 'seconds' and 'do' is wanted.")
    return raw
