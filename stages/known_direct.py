"""Diagnose a real measurement that is no recording of moving points, such as a force, and score it.

reads   the data's own files, in a folder of SURGISIM_DATA
writes  score.json, and physics.json with the laws that were named
"""

from surgisim.config.known import Known
from surgisim.stage import Bytes, stage


@stage(reads={}, writes={"score": Bytes(".json"), "physics": Bytes(".json")}, settings=Known)
def main(*, settings, progress):
    import json

    from surgisim.proof.known.catalogue import answered, chosen
    from surgisim.verification.cases import data

    known = chosen(settings.case)
    found = known.direct(data(known.data), progress)
    told = (answered(settings.case, found, data), found.physics)
    return tuple((json.dumps(body, indent=1, allow_nan=False) + "\n").encode() for body in told)


if __name__ == "__main__":
    main()
