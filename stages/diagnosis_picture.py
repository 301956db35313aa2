"""Draw the mismatch of a diagnosis on the body, before and after the named law, for a README.

reads   a recording folder, and the diagnosis.json, mismatch.npz and physics.json of its diagnosis
writes  picture.jpg
"""

from surgisim.config.base import Settings
from surgisim.stage import Bytes, Source, stage


@stage(
    reads={
        "recording": Source("a recording folder"),
        "diagnosis": Source("diagnosis.json"),
        "mismatch": Source("mismatch.npz of the diagnosis"),
        "physics": Source("physics.json of the diagnosis"),
    },
    writes={"picture": Bytes(".jpg")},
    settings=Settings,
)
def main(*, recording, diagnosis, mismatch, physics, settings, progress):
    from surgisim.report.diagnosed import places
    from surgisim.report.diagnosed.case import read
    from surgisim.report.uri import content

    return content(places.mismatch(read(recording, diagnosis, mismatch, physics)))


if __name__ == "__main__":
    main()
