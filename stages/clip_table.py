"""Hold the replays of many clips against a still body, a rigid one and default parameters.

reads   every run's metrics.json
writes  clips.json, clips.png (every clip's errors with their intervals); prints a line a clip
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

    from surgisim.proof.clip_table import clip_table, in_words
    from surgisim.report.charts.clips import clips

    result = clip_table(metrics)
    print(in_words(result))
    return (json.dumps(result, indent=1, allow_nan=False) + "\n").encode(), clips(result)


if __name__ == "__main__":
    main()
