"""What a diagnosis keeps between starts, and its coloured points."""

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from surgisim.artifacts.base import encoded, save_bytes
from surgisim.artifacts.diagnosis import Diagnosis
from surgisim.artifacts.mismatch import Mismatch
from surgisim.artifacts.physics import Physics
from surgisim.artifacts.ply import write_ply
from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis.elsewhere import known_from, read_elsewhere, words
from surgisim.diagnosis.memo import Memo
from surgisim.digest import digest
from surgisim.recordings.folder import read_recording
from surgisim.stage import Progress

COLD, HOT = np.array([215, 205, 195]), np.array([190, 20, 30])


def memo_for(recording: Path, settings: Diagnosing, folder: Path | None, base: Path | None = None) -> Memo:
    """Finished runs of this recording, these settings and this code; base: of a physics.json that they begin with."""
    content = hashlib.sha256(b"" if base is None else base.read_bytes())
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


def diagnosed(
    recording: Path, settings: Diagnosing, progress, work: Path | None, base: Path | None = None
) -> tuple[Diagnosis, Physics, Mismatch]:
    """What a recording folder's simulation lacks; base: a physics.json in which another recording told of its base."""
    from surgisim.diagnosis.diagnose import diagnose

    seen = read_recording(recording)
    if base is None:
        return diagnose(seen, settings, progress, memo_for(recording, settings, work))
    told = read_elsewhere(base)
    memo = memo_for(recording, settings, work, base)
    diagnosis, *others = diagnose(known_from(seen, told), settings, progress, memo)
    said = f"{diagnosis.words} {words(told, diagnosis.as_given)}"
    return replace(diagnosis, words=said, elsewhere=told.told()), *others


def carry_out(recording: Path, out: Path, settings: Diagnosing, base: Path | None = None) -> str:
    """Diagnose a folder into another. Returns the verdict in words."""
    made = diagnosed(recording, settings, Progress("diagnosis"), out / "work", base)
    header = {"producer": "diagnosis", "settings": settings.model_dump(mode="json"), "code": code()}
    files = {
        out / f"{name}{a.SUFFIX}": encoded(a, **header)
        for name, a in zip(("diagnosis", "physics", "mismatch"), made, strict=True)
    }
    save_bytes(files | {out / "mismatch.ply": cloud(made[2])})
    return f"{made[0].verdict}: {made[0].words}"
