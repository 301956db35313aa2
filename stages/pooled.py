"""Put the cases of several seeds on one board: detection law by law, and every figure, over all of them.

reads   the seeds' scoreboard.json
writes  scoreboard.json, scoreboard.csv, scoreboard.html
"""

from surgisim.config.scoreboard import Scoreboard
from surgisim.stage import Bytes, Several, Source, stage


@stage(
    reads={"boards": Several(Source("the scoreboard.json of a seed"))},
    writes={"board": Bytes(".json"), "table": Bytes(".csv"), "page": Bytes(".html")},
    settings=Scoreboard,
)
def main(boards, *, settings, progress):
    import json

    from surgisim.proof.board import pooled
    from surgisim.report.board.page import page, table

    board = pooled([json.loads(path.read_text()) for path in boards])
    board |= {"pages": settings.pages}
    return (json.dumps(board, indent=1, allow_nan=False) + "\n").encode(), table(board), page(board)


if __name__ == "__main__":
    main()
