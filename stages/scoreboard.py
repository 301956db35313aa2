"""Put all scored cases of a run on one board.

reads   every case's score.json, and its recording folder for what sizes and counts alone would tell
writes  scoreboard.json, scoreboard.csv, scoreboard.html
"""

from surgisim.config.scoreboard import Scoreboard
from surgisim.stage import Bytes, Several, Source, stage


@stage(
    reads={
        "score": Several(Source("a case's score.json")),
        "recording": Several(Source("the recording folders of the same cases, in the same order")),
    },
    writes={"board": Bytes(".json"), "table": Bytes(".csv"), "page": Bytes(".html")},
    settings=Scoreboard,
)
def main(score, recording, *, settings, progress):
    import json

    from surgisim.proof.board import with_metadata
    from surgisim.report.board.page import page, table
    from surgisim.report.made import made

    board = with_metadata([json.loads(path.read_text()) for path in score], recording)
    board |= {"seals": settings.seals or board["count"], "pages": settings.pages}
    return (
        (json.dumps(board, indent=1, allow_nan=False) + "\n").encode(),
        table(board),
        page(board, made({"scoreboard": settings.model_dump(mode="json")})),
    )


if __name__ == "__main__":
    main()
