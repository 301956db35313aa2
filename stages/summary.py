"""Put all runs side by side: clips times variants.

reads   every run's metrics.json, and the thumbnail of its report
writes  summary.json, and summary.html with tables and plots
"""

from surgisim.artifacts.metrics import Metrics
from surgisim.config.summary import Summary
from surgisim.stage import Bytes, Several, Source, stage


@stage(
    reads={"metrics": Several(Metrics), "thumbnails": Several(Source("a report's thumbnail.jpg, one a run"))},
    writes={"table": Bytes(".json"), "page": Bytes(".html")},
    settings=Summary,
)
def main(metrics, thumbnails, *, settings, progress):
    import json

    from surgisim.report.across import page, table
    from surgisim.report.made import made

    pictures = [path.read_bytes() for path in thumbnails]
    whole = (json.dumps(table(metrics), indent=1, allow_nan=False) + "\n").encode()
    return whole, page(metrics, pictures, made(settings.runs))


if __name__ == "__main__":
    main()
