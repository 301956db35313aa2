"""What a diagnosis keeps between starts, and its coloured points."""

import hashlib
from collections.abc import Sequence
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


def memo_for(recording: Path, settings: Diagnosing, folder: Path | None, *others: Path | None) -> Memo:
    """Finished runs of this recording, these settings and this code; others: files and folders that count too."""
    content = hashlib.sha256()
    for where in (recording, *(o for o in others if o is not None)):
        for path in sorted(Path(where).iterdir()) if Path(where).is_dir() else [Path(where)]:
            if path.is_file() and not path.name.startswith(("truth", "salt")):
                content.update(path.name.encode() + path.read_bytes())
    about = f"{content.hexdigest()} {settings.model_dump_json()} {code()}"
    return Memo(folder, about)


def code() -> str:
    """Digest of everything a diagnosis runs."""
    here = Path(__file__)
    return digest(here.with_name("route.py"), here.parents[2])


def cloud(mismatch: Mismatch) -> bytes:
    """The body's particles, the redder the likelier the cause is there."""
    share = np.clip(mismatch.cause, 0, 1)[:, None] ** 0.7
    color = np.round(COLD + share * (HOT - COLD)).astype(np.uint8)
    columns = {name: mismatch.particles[:, k].astype(np.float32) for k, name in enumerate("xyz")}
    columns |= {name: color[:, k] for k, name in enumerate(("red", "green", "blue"))}
    columns["cause"] = mismatch.cause.astype(np.float32)
    return write_ply(columns, {"kind": "Cause"})


def diagnosed(
    recordings: Sequence[Path], settings: Diagnosing, progress, work: Path | None, base: Path | None = None,
    hold_out: Path | None = None,
) -> tuple[Diagnosis, Physics, Mismatch]:  # fmt: skip
    """What the simulation of a body in recording folders lacks.

    base: a physics.json in which another recording told of its base; hold_out: the folder of one that is never fitted.
    """
    from surgisim.diagnosis.route import diagnose_body

    seen = [read_recording(recording) for recording in recordings]
    held = None if hold_out is None else read_recording(hold_out)
    told = None if base is None else read_elsewhere(base)
    if told is not None:
        seen = [known_from(recording, told) for recording in seen]
    memo = memo_for(recordings[0], settings, work, *recordings[1:], base, hold_out)
    diagnosis, *others = diagnose_body(seen, held, settings, progress, memo)
    if told is not None:
        said = f"{diagnosis.words} {words(told, diagnosis.as_given)}"
        diagnosis = replace(diagnosis, words=said, elsewhere=told.told())
    return diagnosis, *others


def carry_out(
    recordings: Sequence[Path], out: Path, settings: Diagnosing, base: Path | None = None, hold_out: Path | None = None
) -> str:
    """Diagnose folders of one body into another. Returns the verdict in words."""
    made = diagnosed(recordings, settings, Progress("diagnosis"), out / "work", base, hold_out)
    header = {"producer": "diagnosis", "settings": settings.model_dump(mode="json"), "code": code()}
    files = {
        out / f"{name}{a.SUFFIX}": encoded(a, **header)
        for name, a in zip(("diagnosis", "physics", "mismatch"), made, strict=True)
    }
    save_bytes(files | {out / "mismatch.ply": cloud(made[2])})
    return f"{made[0].verdict}: {made[0].words}"
