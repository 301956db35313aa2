"""Open what a case concealed, and hold its diagnosis against it.

reads   a recording folder, its diagnosis, and what was sealed with its seal and the run's log of seals;
        of a clip what the graph took its camera to be, camera.json
writes  score.json

No other stage opens a truth. It refuses to where the truth is not the one that was sealed before the diagnosis.
"""

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.mismatch import Mismatch
from surgisim.config.base import Settings
from surgisim.stage import Bytes, Maybe, Source, stage


@stage(
    reads={
        "recording": Source("a recording folder"),
        "diagnosis": Source("diagnosis.json"),
        "mismatch": Maybe(Mismatch),
        "physics": Source("physics.json of the diagnosis, for its grid", required=False),
        "seal": Source("the case's seal.txt"),
        "seals": Source("seals.txt, written before any diagnosis"),
        "truth": Source("truth.json, sealed"),
        "truth_tracks": Source("truth.npz, sealed"),
        "salt": Source("salt.txt, sealed"),
        "camera": Maybe(Camera),
    },
    writes={"score": Bytes(".json")},
    settings=Settings,
)
def main(
    *, recording, diagnosis, mismatch, physics, seal, seals, truth, truth_tracks, salt, camera, settings, progress
):
    import json

    from surgisim.artifacts.verdict import read_verdict
    from surgisim.proof.case import score
    from surgisim.proof.tracked import as_tracked
    from surgisim.proof.truth import opened
    from surgisim.recordings.folder import read_recording

    cell = json.loads(physics.read_text())["grid"]["spacing"] if physics else None
    shown = opened(truth.read_bytes(), truth_tracks.read_bytes(), salt.read_text(), seal.read_text(), seals.read_text())
    tracks = read_recording(recording)
    shown = as_tracked(shown, tracks, camera) if camera else shown
    result = score(shown, tracks, read_verdict(diagnosis), mismatch, cell)
    return (json.dumps(result, indent=1, allow_nan=False) + "\n").encode()


if __name__ == "__main__":
    main()
