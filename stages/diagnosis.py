"""Say what physics a recording's simulation lacks: locate the mismatch, name the law, model it, show the fit improve.

reads   a recording folder (surgisim/recordings/folder.py); if there is one, the physics.json of another recording
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
        "base": Source("physics.json in which another recording told of this body's base", required=False),
        "hold_out": Source("a folder of another recording of the body, which is never fitted", required=False),
    },
    writes={"diagnosis": Diagnosis, "physics": Physics, "mismatch": Mismatch, "cloud": Bytes(".ply")},
    settings=Diagnosing,
)
def main(recording, work, base, hold_out, *, settings, progress):
    from surgisim.diagnosis.files import cloud, diagnosed

    found, physics, mismatch = diagnosed([recording], settings, progress, work, base, hold_out)
    return found, physics, mismatch, cloud(mismatch)


if __name__ == "__main__":
    main()
