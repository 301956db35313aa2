"""A recording as a folder: recording.json, rest.ply, fixed.json, tracks.npz; grip.npz, forces.npz, split.json if any.

recording.json  format, name, fps, frames, length_unit (m, cm or mm; of every file), density_kg_m3 or null,
                gravity_m_s2 [x, y, z] or null, tier; optional starts: "settled" (default) or "released";
                astray: of how far a point has gone, how far its track is off, beside sigma; expected: 90 % intervals
                [low, high] of the base's "E" [Pa] and "eta / E" [s], where they are known beforehand
rest.ply        closed triangle mesh of the body at rest
fixed.json      {"boxes": [{"min": [x, y, z], "max": [x, y, z]}]}: regions of rest space held still;
                optional torn: walls along z, [[x, y], [x, y]] each, through which the body does not hang together
grip.npz        center_rest (J, 3), radius (J,), position (J, T, 3), active (J, T): translating grips; optional rim
                (E, T, 3) and rim_radius (E,): balls of tissue that go along all the time with what is beyond the body
tracks.npz      points (K, T, 3), NaN where unseen; visible (K, T); sigma (K,); optional place (K, 3) on the rest body,
                axes (K, 3): noise along x, y and z over sigma, RMS 1, where it is not alike; or along the rows of
                ways (K, 3, 3), orthonormal; doubts (C, K, T, 3): where points would go instead, less where they are
                taken to go, were one of C things otherwise by a standard deviation (recording.json: doubts, its names)
forces.npz      force (J, T, 3) of each grip on the tissue [N], NaN where it is not known, sigma (J,); optional held
                (1, T, 3) and held_sigma (1,): of what is held (forces.py)
split.json      {"fit": [0, t1], "held_out": [t1, T]}

Keys that are not named here are passed over.
"""

import io
import json
from pathlib import Path

import numpy as np

from surgisim.artifacts.base import save_bytes
from surgisim.artifacts.motion import Motion
from surgisim.problem import Problem
from surgisim.recordings.arrays import arrays
from surgisim.recordings.facts import boxes_of, facts, split_of, torn_of
from surgisim.recordings.forces import encoded_forces, read_forces
from surgisim.recordings.mesh import Mesh, closed
from surgisim.recordings.ply import read_mesh, write_mesh
from surgisim.recordings.recording import Recording, no_grips

FORMAT = "surgisim-recording/1"
NAME = "recording.json"
LEAST, MOST = 1e-3, 10.0
"""Length of a body [m]: beyond, its unit is another one."""


def is_recording(path: Path) -> bool:
    """Whether `path` is a folder of this kind."""
    return (path / NAME).is_file()


def read_recording(folder: Path) -> Recording:
    """The recording in `folder`, in metres. Raises Problem, naming the file, for anything missing or malformed."""
    told = facts(folder / NAME, FORMAT)
    unit, frames = told["unit"], told["frames"]
    shape = read_mesh(_there(folder / "rest.ply"))
    mesh = closed(Mesh(shape.vertices * unit, shape.faces), str(folder / "rest.ply"))
    long = float(np.ptp(mesh.vertices, axis=0).max())
    if not LEAST < long < MOST:
        raise Problem(
            f"{folder / 'rest.ply'}: the body is {long:.3g} m long, but between {LEAST:g} and {MOST:g} m are wanted. "
            "Mend 'length_unit' in recording.json, which every file is in, or the mesh."
        )
    tracks = arrays(
        _there(folder / "tracks.npz"),
        {"points": "KT3", "visible": "KT", "sigma": "K", "place": "K3", "axes": "K3", "ways": "K33", "doubts": "CKT3"},
        frames,
        ("place", "axes", "ways", "doubts"),
    )
    points, visible = tracks["points"] * unit, tracks["visible"].astype(bool)
    if not np.isfinite(points[visible]).all():
        k, t = np.argwhere(visible & ~np.isfinite(points).all(-1))[0]
        raise Problem(
            f"{folder / 'tracks.npz'}: point {k} is called visible in frame {t}, but its position is not a number. "
            "Mark it unseen, or give its position."
        )
    unseen = np.flatnonzero(~visible.any(1))
    if len(unseen) and "place" not in tracks:
        raise Problem(f"{folder / 'tracks.npz'}: point {unseen[0]} is never visible. Leave it out.")
    if not (np.isfinite(tracks["sigma"]) & (tracks["sigma"] >= 0)).all():
        raise Problem(f"{folder / 'tracks.npz'}: sigma must be finite and not negative. Give each point's noise.")
    axes = tracks["axes"].astype(float) if "axes" in tracks else None
    if axes is not None and not (np.isfinite(axes) & (axes > 0)).all():
        raise Problem(
            f"{folder / 'tracks.npz'}: axes must be finite and positive. Give how noise is shared by x, y, z."
        )
    ways = tracks["ways"].astype(float) if "ways" in tracks else None
    if ways is not None:
        if axes is None:
            raise Problem(f"{folder / 'tracks.npz'}: ways has the directions of axes, which are missing. Give both.")
        off = np.abs(ways @ np.swapaxes(ways, 1, 2) - np.eye(3)).max((1, 2))
        askew = np.flatnonzero(~(off < 1e-3))
        if len(askew):
            raise Problem(
                f"{folder / 'tracks.npz'}: the ways of point {askew[0]} are not of length 1 or not at right angles. "
                "Give the rows of a rotation."
            )
    motion = _motion(folder / "grip.npz", frames, unit)
    return Recording(
        name=told["name"],
        fps=told["fps"],
        mesh=mesh,
        boxes=boxes_of(_there(folder / "fixed.json")) * unit,
        torn=torn_of(folder / "fixed.json") * unit,
        points=np.where(visible[..., None], points, np.nan).astype(np.float32),
        visible=visible,
        sigma=tracks["sigma"].astype(float) * unit,
        motion=motion,
        forces=read_forces(folder / "forces.npz", frames, len(motion.radius)),
        density=told["density"],
        gravity=told["gravity"],
        tier=told["tier"],
        starts=told["starts"],
        place=tracks["place"].astype(float) * unit if "place" in tracks else None,
        axes=None if axes is None else axes / np.sqrt((axes**2).mean(1, keepdims=True)),
        ways=ways,
        doubts=_doubts(folder, told["doubts"], tracks.get("doubts"), unit),
        astray=told["astray"],
        expected=told["expected"],
        split=split_of(folder / "split.json", frames) if (folder / "split.json").is_file() else None,
    )


def write_recording(recording: Recording, folder: Path) -> None:
    """Write the folder in metres; its files appear together or not at all."""
    save_bytes({folder / name: content for name, content in encoded_recording(recording).items()})


def encoded_recording(recording: Recording) -> dict[str, bytes]:
    """File name -> bytes of the folder."""
    told = {
        "format": FORMAT,
        "name": recording.name,
        "fps": recording.fps,
        "frames": recording.frames,
        "length_unit": "m",
        "density_kg_m3": recording.density,
        "gravity_m_s2": None if recording.gravity is None else list(recording.gravity),
        "tier": recording.tier,
        "starts": recording.starts,
    }
    boxes = [{"min": low.tolist(), "max": high.tolist()} for low, high in recording.boxes]
    motion = recording.motion
    tracks = {"points": recording.points.astype(np.float32), "visible": recording.visible, "sigma": recording.sigma}
    if recording.place is not None:
        tracks["place"] = recording.place
    if recording.axes is not None:
        tracks["axes"] = recording.axes
    if recording.ways is not None:
        tracks["ways"] = recording.ways
    if recording.astray:
        told["astray"] = recording.astray
    if recording.expected:
        told["expected"] = {name: list(span) for name, span in recording.expected.items()}
    if recording.doubts:
        told["doubts"] = list(recording.doubts)
        tracks["doubts"] = np.stack(list(recording.doubts.values())).astype(np.float32)
    grips = {"center_rest": motion.center_rest, "radius": motion.radius}
    grips |= {"position": motion.position, "active": motion.active}
    if len(motion.rim):
        grips |= {"rim": motion.rim, "rim_radius": motion.rim_radius}
    files = {
        NAME: _json(told),
        "rest.ply": write_mesh(recording.mesh),
        "fixed.json": _json({"boxes": boxes} | ({"torn": recording.torn.tolist()} if len(recording.torn) else {})),
        "tracks.npz": _npz(tracks),
        "grip.npz": _npz(grips),
    }
    if recording.forces is not None:
        files["forces.npz"] = _npz(encoded_forces(recording.forces))
    if recording.split is not None:
        files["split.json"] = _json({name: list(span) for name, span in recording.split.items()})
    return files


def _doubts(folder: Path, names: list[str], moved: np.ndarray | None, unit: float) -> dict[str, np.ndarray]:
    count = 0 if moved is None else len(moved)
    if len(names) != count or len(set(names)) != count:
        raise Problem(
            f"{folder / NAME}: 'doubts' has {len(names)} names, and tracks.npz has doubts of {count} things. Give each "
            "one name of its own."
        )
    if moved is not None and not np.isfinite(moved).all():
        raise Problem(f"{folder / 'tracks.npz'}: doubts must be finite. Give zero where a point does not move by it.")
    return dict(zip(names, moved * unit, strict=True)) if count else {}


def _motion(path: Path, frames: int, unit: float) -> Motion:
    if not path.is_file():
        return no_grips(frames)
    shapes = {"center_rest": "J3", "radius": "J", "position": "JT3", "active": "JT", "rim": "ET3", "rim_radius": "E"}
    grips = arrays(path, shapes, frames, optional=("rim", "rim_radius"))
    if not len(grips["radius"]):
        return no_grips(frames)
    active = grips["active"].astype(bool)
    position = grips["position"].astype(float) * unit
    if not np.isfinite(position[active]).all() or not np.isfinite(grips["center_rest"]).all():
        raise Problem(f"{path}: a grip that holds has a position that is not a number. Give it, or end the grip.")
    if not (grips["radius"] > 0).all():
        raise Problem(f"{path}: radius {grips['radius'].min():g} is not positive. Give each grip's radius.")
    center = grips["center_rest"].astype(float) * unit
    # Where a grip does not hold, its position does not matter, but the path between must be one.
    position = np.where(np.isfinite(position), position, _carried_on(position, active, center))
    rim = {name: grips[name].astype(float) * unit for name in ("rim", "rim_radius") if name in grips}
    if len(rim) == 1:
        raise Problem(f"{path}: has only '{next(iter(rim))}' of 'rim' and 'rim_radius'. Give both, or neither.")
    sure = np.ones(len(active))
    return Motion(center, grips["radius"].astype(float) * unit, position, active, sure, source="given", **rim)


def _carried_on(position: np.ndarray, active: np.ndarray, center: np.ndarray) -> np.ndarray:
    """Position at the last frame before that is known, the rest centre before all of them, (J, T, 3)."""
    known = np.isfinite(position).all(-1)
    latest = np.maximum.accumulate(np.where(known, np.arange(known.shape[1]), -1), axis=1)
    found = position[np.arange(len(position))[:, None], np.maximum(latest, 0)]
    return np.where((latest >= 0)[..., None], found, center[:, None])


def _there(path: Path) -> Path:
    if not path.is_file():
        raise Problem(f"{path}: no such file, but every recording has one. Add it; {NAME} beside it says what this is.")
    return path


def _json(body: dict) -> bytes:
    return (json.dumps(body, indent=1, allow_nan=False) + "\n").encode()


def _npz(fields: dict[str, np.ndarray]) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, **fields)
    return stream.getvalue()
