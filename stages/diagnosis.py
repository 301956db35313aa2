"""Say what physics a recording's simulation lacks: locate the mismatch, name the law, model it, show the fit improve.

reads   a recording folder (surgisim/recordings/folder.py)
writes  diagnosis.json   the verdict, what is named, how surely, what the clip cannot tell
        physics.json     the base's laws and the named one
        mismatch.npz, mismatch.ply   where and when; the particles, coloured by how likely the cause is there
"""

from surgisim.artifacts.diagnosis import Diagnosis
from surgisim.artifacts.mismatch import Mismatch
from surgisim.artifacts.physics import Physics
from surgisim.config.diagnosis import Diagnosing
from surgisim.stage import Bytes, Source, stage


@stage(
    reads={
        "recording": Source("a recording folder"),
        "work": Source("a folder that keeps finished runs, so that a second start goes on", required=False),
    },
    writes={"diagnosis": Diagnosis, "physics": Physics, "mismatch": Mismatch, "cloud": Bytes(".ply")},
    settings=Diagnosing,
)
def main(recording, work, *, settings, progress):
    from surgisim.diagnosis.diagnose import diagnose
    from surgisim.diagnosis.files import cloud, memo_for
    from surgisim.recordings.folder import read_recording

    found, physics, mismatch = diagnose(
        read_recording(recording), settings, progress, memo_for(recording, settings, work)
    )
    return found, physics, mismatch, cloud(mismatch)


if __name__ == "__main__":
    main()
