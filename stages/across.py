"""Leave one family of generators out: learn thresholds and temperatures of the others, and score it with them.

reads   the scoreboard.json of every family
writes  across.json, across.html
"""

from surgisim.config.across import Across
from surgisim.stage import Bytes, Several, Source, stage


@stage(
    reads={"boards": Several(Source("the scoreboard.json of a family"))},
    writes={"table": Bytes(".json"), "page": Bytes(".html")},
    settings=Across,
)
def main(boards, *, settings, progress):
    import json

    from surgisim.proof.across import across
    from surgisim.report.board.across import page
    from surgisim.report.made import made

    told = [json.loads(path.read_text()) for path in boards]
    found = across(dict(zip(settings.families, told, strict=True)))
    return (json.dumps(found, indent=1, allow_nan=False) + "\n").encode(), page(found, made())


if __name__ == "__main__":
    main()
