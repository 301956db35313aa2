"""Put the scoreboards of several ways to diagnose the same cases side by side.

reads   every way's scoreboard.json; the first is the method
writes  ablations.json, ablations.html
"""

from surgisim.config.ablations import Ablations
from surgisim.stage import Bytes, Several, Source, stage


@stage(
    reads={"board": Several(Source("a way's scoreboard.json"))},
    writes={"table": Bytes(".json"), "page": Bytes(".html")},
    settings=Ablations,
)
def main(board, *, settings, progress):
    import json

    from surgisim.proof.ablations import losses
    from surgisim.report.board.ablations import page
    from surgisim.report.made import made

    found = losses({name: json.loads(path.read_text()) for name, path in zip(settings.ways, board, strict=True)})
    told = made({"ablations": settings.model_dump(mode="json")})
    return (json.dumps(found, indent=1, allow_nan=False) + "\n").encode(), page(found, told)


if __name__ == "__main__":
    main()
