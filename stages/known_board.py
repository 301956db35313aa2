"""Put all real recordings with a known cause on one page.

reads   every recording's score.json
writes  known.json, known.html
"""

from surgisim.config.base import Settings
from surgisim.stage import Bytes, Several, Source, stage


@stage(
    reads={"score": Several(Source("a recording's score.json"))},
    writes={"table": Bytes(".json"), "page": Bytes(".html")},
    settings=Settings,
)
def main(score, *, settings, progress):
    import json

    from surgisim.report.board.known import page
    from surgisim.report.made import made

    cases = [json.loads(path.read_text()) for path in score]
    return (json.dumps(cases, indent=1, allow_nan=False) + "\n").encode(), page(cases, made())


if __name__ == "__main__":
    main()
