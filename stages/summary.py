"""Put all runs side by side: clips times variants.

reads   every run's metrics.json
writes  summary.json, and summary.html with tables and plots
"""

from surgisim.artifacts.metrics import Metrics
from surgisim.config.summary import Summary
from surgisim.stage import Bytes, Several, stage


@stage(
    reads={"metrics": Several(Metrics)},
    writes={"table": Bytes(".json"), "page": Bytes(".html")},
    settings=Summary,
)
def main(metrics, *, settings, progress):
    import json

    from surgisim.report.across import page, table

    return (json.dumps(table(metrics), indent=1, allow_nan=False) + "\n").encode(), page(metrics)


if __name__ == "__main__":
    main()
