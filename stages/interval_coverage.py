"""Count how often the intervals of clips with truth hold it.

reads   every run's metrics.json
writes  coverage.json, coverage.png (every interval over its truth); prints a line a parameter
"""

from surgisim.artifacts.metrics import Metrics
from surgisim.config.summary import Summary
from surgisim.stage import Bytes, Several, stage


@stage(
    reads={"metrics": Several(Metrics)},
    writes={"table": Bytes(".json"), "picture": Bytes(".png")},
    settings=Summary,
)
def main(metrics, *, settings, progress):
    import json

    from surgisim.proof.coverage import coverage, in_words
    from surgisim.report.charts.intervals import intervals

    result = coverage(metrics)
    print(in_words(result))
    return (json.dumps(result, indent=1, allow_nan=False) + "\n").encode(), intervals(result)


if __name__ == "__main__":
    main()
