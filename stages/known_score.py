"""Hold the diagnosis of a real recording against the cause that its makers know.

reads   diagnosis.json and physics.json, and the data's own files, in a folder of SURGISIM_DATA
writes  score.json
"""

from surgisim.config.known import Known
from surgisim.stage import Bytes, Source, stage


@stage(
    reads={"diagnosis": Source("diagnosis.json"), "physics": Source("physics.json of the diagnosis")},
    writes={"score": Bytes(".json")},
    settings=Known,
)
def main(diagnosis, physics, *, settings, progress):
    import json

    from surgisim.artifacts.verdict import read_verdict
    from surgisim.proof.known.catalogue import Found, answered
    from surgisim.verification.cases import data

    found = Found(read_verdict(diagnosis), json.loads(physics.read_text()))
    return (json.dumps(answered(settings.case, found, data), indent=1, allow_nan=False) + "\n").encode()


if __name__ == "__main__":
    main()
