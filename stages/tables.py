"""Put the paper's tables together from finished runs, ours beside what it prints.

reads   metrics.json of whole runs and of scenes alone, the recordings they are of, pictures of scenes' surfaces
writes  tables.json (with the receipt: digests of recordings and code, settings), tables.html, .csv and .md
"""

from surgisim.artifacts.metrics import Metrics
from surgisim.config.tables import Tables
from surgisim.stage import Bytes, Several, Source, stage


@stage(
    reads={
        "metrics": Several(Metrics),
        "scenes": Several(Metrics),
        "recordings": Several(Source("a recording: a file or a folder")),
        "pictures": Several(Source("scene_score's picture")),
    },
    writes={"table": Bytes(".json"), "page": Bytes(".html"), "sheet": Bytes(".csv"), "text": Bytes(".md")},
    settings=Tables,
)
def main(metrics, scenes, recordings, pictures, *, settings, progress):
    import json

    from surgisim.proof.tables import digest_of, tables
    from surgisim.report.board.tables import as_csv, as_markdown, page
    from surgisim.report.made import made

    digests = {clip: digest_of(path) for clip, path in zip(settings.clips, recordings, strict=True)}
    found = tables(metrics, scenes, {"recordings": digests, **settings.receipt})
    whole = (json.dumps(found, indent=1, allow_nan=False) + "\n").encode()
    return whole, page(found, [path.read_bytes() for path in pictures], made()), as_csv(found), as_markdown(found)


if __name__ == "__main__":
    main()
