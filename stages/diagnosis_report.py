"""Put a diagnosis on one page: where, when, why this name, what it gains, and what the clip cannot tell.

reads   a recording folder, and the diagnosis.json, mismatch.npz and physics.json of its diagnosis
writes  diagnosis.html    one file, nothing outside it
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
    writes={"page": Bytes(".html")},
    settings=Settings,
)
def main(*, recording, diagnosis, mismatch, physics, settings, progress):
    from surgisim.report.diagnosed.case import read
    from surgisim.report.diagnosed.page import page

    case = read(recording, diagnosis, mismatch, physics)
    return page(case, case.made(), progress=progress)


if __name__ == "__main__":
    main()
