"""Recordings, truths and diagnoses made by hand: a plate of points that rises and sinks, twice."""

import hashlib
import io
import json
from pathlib import Path

import numpy as np

from surgisim.artifacts.base import encoded
from surgisim.artifacts.mismatch import Mismatch
from surgisim.artifacts.motion import Motion
from surgisim.recordings.folder import write_recording
from surgisim.recordings.mesh import Mesh
from surgisim.recordings.recording import Recording

FPS, FRAMES, SPLIT = 10.0, 40, 24
BOX = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
SIDES = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
         [1, 5, 7], [1, 7, 3]]  # fmt: skip


def way() -> np.ndarray:
    """How far each grip has pulled, 0-1, (2, T)."""
    t = np.arange(FRAMES)
    return np.stack([np.interp(t, [4, 8, 14, 15], [0, 1, 1, 0]), np.interp(t, [27, 30, 34, 35], [0, 1, 1, 0])])


def paths(extra: float = 0.0, points: int = 12) -> np.ndarray:
    """Noise-free paths [m], (K, T, 3); `extra` [m] is what an effect adds at the height of the pulls."""
    rest = np.random.default_rng(5).uniform([0, 0, 0.02], [0.06, 0.04, 0.02], (points, 3))
    lift = way().sum(0)[None, :] * np.exp(-(((rest[:, :1] - 0.03) / 0.02) ** 2))
    return rest[:, None] + (0.008 + extra) * lift[..., None] * np.array([0.0, 0.0, 1.0])


def recording(name: str = "r-made", extra: float = 0.0, sigma: float = 3e-4, seed: int = 0) -> Recording:
    true = paths(extra)
    rng = np.random.default_rng(seed)
    seen = true + sigma * rng.standard_normal(true.shape)
    visible = rng.random(true.shape[:2]) > 0.05
    visible[:, 0] = True
    center = np.array([[0.03, 0.02, 0.02], [0.045, 0.03, 0.02]])
    position = center[:, None] + 0.008 * way()[..., None] * np.array([0.0, 0.0, 1.0])
    t = np.arange(FRAMES)
    active = np.stack([(t >= 4) & (t <= 14), (t >= 27) & (t <= 34)])
    return Recording(
        name=name,
        fps=FPS,
        mesh=Mesh(BOX * [0.06, 0.04, 0.02], np.array(SIDES)),
        boxes=np.array([[[-1, -1, -1], [1, 1, 0.004]]]),
        points=np.where(visible[..., None], seen, np.nan).astype(np.float32),
        visible=visible,
        sigma=np.full(len(seen), sigma),
        motion=Motion(center, np.full(2, 0.005), position, active, np.ones(2), source="given"),
        density=1050.0,
        gravity=(0.0, 0.0, -9.81),
        split={"fit": (0, SPLIT), "held_out": (SPLIT, FRAMES)},
    )


PLACE = {"center": [0.03, 0.02, 0.012], "extent": 0.006, "unit": "m"}


def effect(term: str = "stiff_inclusion", **changed) -> dict:
    """What a truth says of one effect."""
    told = {
        "term": term,
        "outside_catalogue": False,
        "place": PLACE,
        "time": {"onset": None, "end": None},
        "parameters": {"factor": {"value": 4.0, "unit": "1"}},
        "magnitude": 4.0,
        "snr_asked": 3.5,
        "snr_alone_coarse": 3.5,
    }
    return told | changed


def npz(**arrays) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


def truth(
    name: str = "r-made",
    kind: str = "one",
    effects: tuple = (effect(),),
    snr: float = 4.0,
    extra: float = 0.0,
    case: int = 0,
) -> tuple[bytes, bytes]:
    """truth.json and truth.npz."""
    tracks = npz(plain=paths().astype(np.float32), true=paths(extra).astype(np.float32))
    told = {
        "format": "surgisim-blind-truth/1",
        "recording": name,
        "seed": 7,
        "case": case,
        "kind": kind,
        "effects": list(effects),
        "snr": snr,
        "snr_held_out": snr,
        "noise": 3e-4,
        "base": {"E": 3000.0, "nu": 0.45, "eta": 5.0, "density": 1050.0},
        "phases": [{"begin": 4, "arrive": 8, "release": 14}, {"begin": 27, "arrive": 30, "release": 34}],
        "tracks_sha256": hashlib.sha256(tracks).hexdigest(),
    }
    return json.dumps(told).encode(), tracks


def named(term: str = "stiff_inclusion", probability: float = 0.9, **changed) -> dict:
    """One effect of a diagnosis."""
    told = {
        "term": term,
        "probability": probability,
        "place": {"center": [0.031, 0.022, 0.014], "extent": 0.007, "unit": "m"},
        "time": {"onset": 0.0, "end": None},
        "parameters": {"s": {"value": 4.4, "low": 3.5, "high": 5.6, "unit": "1"}},
        "runners_up": [{"term": "tether", "probability": 0.06}],
        "separating_experiment": "Pull the tissue sideways over the place, 8 mm.",
    }
    return told | changed


RANKED = (("stiff_inclusion", 41.0, 0.9, 1.0), ("tether", 38.2, 0.06, 0.83), ("fibre", 31.0, 0.01, 0.4))


def diagnosis(name: str = "r-made", verdict: str = "named", effects: tuple | None = None, **changed) -> dict:
    effects = ((named(),) if verdict in ("named", "equivalence class") else ()) if effects is None else effects
    told = {
        "format": "surgisim-diagnosis/1",
        "recording": name,
        "verdict": verdict,
        "effects": list(effects),
        "detectable_above": {"value": 0.12, "unit": "mm"},
        "missing_phases": [],
        "fit": {"noise_floor": 0.5, "before": 0.9, "after": 0.54, "placebo": 0.85, "flexible": 0.5, "unit": "mm"},
        "held_out": {"noise_floor": 0.5, "before": 0.95, "after": 0.57, "placebo": 0.9, "flexible": 0.55, "unit": "mm"},
        "unexplained_fraction": 0.12,
        "words": "The tissue gives way less over one place. A stiff lump there removes 84 % of the held-out error.",
        "ranking": [
            {"term": t, "place": PLACE, "log_evidence": e, "probability": p, "cos": c, "held_out_rms": 0.5}
            for t, e, p, c in RANKED
        ],
    }  # fmt: skip
    return told | changed


def mismatch(made: Recording, extra: float, left: float = 0.1) -> bytes:
    """What a diagnosis leaves beside its verdict; `left` is the share of the effect that stays unexplained."""
    before = made.points - paths().astype(np.float32)
    after = made.points - paths((1 - left) * extra).astype(np.float32)
    grid = np.stack(np.meshgrid(*(np.linspace(0.002, h, n) for h, n in ((0.058, 20), (0.038, 14), (0.018, 7)))), -1)
    particles = grid.reshape(-1, 3)
    cause = np.exp(-((particles - PLACE["center"]) ** 2).sum(1) / (2 * 0.006**2))
    phase = np.repeat([0, 1, 2, 3, 1, 2, 3], [4, 4, 7, 12, 3, 5, 5])
    z = np.linalg.norm(before, axis=-1) / 3e-4
    found = Mismatch(
        points=made.attached(),
        residual_before=before,
        residual_after=after,
        z=np.where(made.visible, z, np.nan),
        significant=4.0,
        particles=particles,
        cause=cause,
        cause_time=way().sum(0),
        phase=phase,
    )
    return encoded(found, producer="made up", settings={}, code="")


def case(
    folder: Path, *, name: str = "r-made", extra: float = 1e-3, left: float = 0.1, told: dict | None = None, **concealed
) -> Path:
    """Everything that a score needs, as the rules lay it out."""
    from surgisim.phantom.seal import salt, seal

    made = recording(name, extra)
    write_recording(made, folder / "recording")
    hidden, tracks = truth(name, extra=extra, **concealed)
    secret = salt()
    files = {
        "sealed/truth.json": hidden,
        "sealed/truth.npz": tracks,
        "sealed/salt.txt": secret.encode(),
        "seal.txt": seal(hidden, secret).encode(),
        "diagnosis.json": json.dumps(told or diagnosis(name)).encode(),
        "mismatch.npz": mismatch(made, extra, left),
        "physics.json": json.dumps({"grid": {"spacing": 0.003, "step": 1e-4}}).encode(),
    }
    for path, content in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(content)
    return folder
