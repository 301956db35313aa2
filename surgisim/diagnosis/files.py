"""What a diagnosis keeps between starts, and its coloured points."""

import hashlib
from pathlib import Path

import numpy as np

from surgisim.artifacts.base import encoded, save_bytes
from surgisim.artifacts.mismatch import Mismatch
from surgisim.artifacts.ply import write_ply
from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis.memo import Memo
from surgisim.digest import digest
from surgisim.recordings.folder import read_recording
from surgisim.stage import Progress

COLD, HOT = np.array([215, 205, 195]), np.array([190, 20, 30])


def memo_for(recording: Path, settings: Diagnosing, folder: Path | None) -> Memo:
    """Finished runs of this recording, these settings and this code."""
    content = hashlib.sha256()
    for path in sorted(
        p for p in Path(recording).iterdir() if p.is_file() and not p.name.startswith(("truth", "salt"))
    ):
        content.update(path.name.encode() + path.read_bytes())
    about = f"{content.hexdigest()} {settings.model_dump_json()} {code()}"
    return Memo(folder, about)


def code() -> str:
    """Digest of everything a diagnosis runs."""
    here = Path(__file__)
    return digest(here.with_name("diagnose.py"), here.parents[2])


def cloud(mismatch: Mismatch) -> bytes:
    """The body's particles, the redder the likelier the cause is there."""
    share = np.clip(mismatch.cause, 0, 1)[:, None] ** 0.7
    color = np.round(COLD + share * (HOT - COLD)).astype(np.uint8)
    columns = {name: mismatch.particles[:, k].astype(np.float32) for k, name in enumerate("xyz")}
    columns |= {name: color[:, k] for k, name in enumerate(("red", "green", "blue"))}
    columns["cause"] = mismatch.cause.astype(np.float32)
    return write_ply(columns, {"kind": "Cause"})


def carry_out(recording: Path, out: Path, settings: Diagnosing) -> str:
    """Diagnose a folder into another. Returns the verdict in words."""
    from surgisim.diagnosis.diagnose import diagnose

    made = diagnose(
        read_recording(recording), settings, Progress("diagnosis"), memo_for(recording, settings, out / "work")
    )
    header = {"producer": "diagnosis", "settings": settings.model_dump(mode="json"), "code": code()}
    files = {
        out / f"{name}{a.SUFFIX}": encoded(a, **header)
        for name, a in zip(("diagnosis", "physics", "mismatch"), made, strict=True)
    }
    save_bytes(files | {out / "mismatch.ply": cloud(made[2])})
    return f"{made[0].verdict}: {made[0].words}"
