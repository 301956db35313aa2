"""Compare the evidence of drawn recordings with the nulls that their diagnoses state.

reads   diagnosis.json of every drawn recording
writes  self_consistency.json, self_consistency.png
"""

from surgisim.config.base import Settings
from surgisim.stage import Bytes, Several, Source, stage


@stage(
    reads={"diagnoses": Several(Source("a drawn recording's diagnosis.json"))},
    writes={"table": Bytes(".json"), "picture": Bytes(".png")},
    settings=Settings,
)
def main(diagnoses, *, settings, progress):
    import json

    from surgisim.proof.self_consistency import consistency
    from surgisim.report.board.self_consistency import picture

    found = consistency([json.loads(path.read_text()) for path in diagnoses])
    return (json.dumps(found, indent=1, allow_nan=False) + "\n").encode(), picture(found)


if __name__ == "__main__":
    main()
