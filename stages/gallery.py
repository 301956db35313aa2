"""Put finished runs and opened diagnoses on one page that is small enough to publish.

reads   of every run its small pictures, fitted parameters and numbers; of every concealed case its recording, its
        diagnosis, and its score
writes  gallery.html    one file, nothing outside it
"""

from surgisim.artifacts.fit import Fit
from surgisim.artifacts.metrics import Metrics
from surgisim.artifacts.physics import Physics
from surgisim.config.pictures import Gallery
from surgisim.stage import Bytes, Several, Source, stage


@stage(
    reads={
        "moving": Several(Source("moving.webp of clip_pictures, one a run")),
        "still": Several(Source("scene.jpg of clip_pictures, one a run")),
        "fitted": Several(Source("body.jpg of clip_pictures, one a run")),
        "physics": Several(Physics),
        "fit": Several(Fit),
        "metrics": Several(Metrics),
        "recording": Several(Source("a recording folder, one a case")),
        "diagnosis": Several(Source("diagnosis.json, one a case")),
        "mismatch": Several(Source("mismatch.npz, one a case")),
        "named": Several(Source("physics.json of the diagnosis, one a case")),
        "score": Several(Source("score.json, one a case")),
    },
    writes={"page": Bytes(".html")},
    settings=Gallery,
)
def main(
    moving, still, fitted, physics, fit, metrics, recording, diagnosis, mismatch, named, score, *, settings, progress
):
    from surgisim.report.gallery import PICTURES, opened, page, run
    from surgisim.report.made import made

    drawings = [
        dict(zip(PICTURES, [p.read_bytes() for p in each], strict=True))
        for each in zip(moving, still, fitted, strict=True)
    ]
    runs = [run(*each) for each in zip(settings.clips, drawings, physics, fit, metrics, strict=True)]
    cases = [opened(*each) for each in zip(recording, diagnosis, mismatch, named, score, strict=True)]
    return page(runs, cases, made(), settings.most_bytes)


if __name__ == "__main__":
    main()
