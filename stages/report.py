"""Put a run on one page: films, every stage's pictures, curves, tables, and what to distrust.

reads   every artifact of the run, and metrics.json
writes  report.html     one file, nothing outside it
        yt.png          one column of pixels over time, recording above and replay below, with axes
        thumbnail.jpg   the recording beside the replay at one moment, for pages with many runs
"""

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.deformation import Deformation
from surgisim.artifacts.depth import Depth
from surgisim.artifacts.fit import Fit
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.artifacts.inpainted import Inpainted
from surgisim.artifacts.masks import Masks
from surgisim.artifacts.material import Material
from surgisim.artifacts.metrics import Metrics
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.physics import Physics
from surgisim.artifacts.replay import Replay
from surgisim.artifacts.scene import Scene
from surgisim.artifacts.tracks import Tracks
from surgisim.artifacts.truth import Truth
from surgisim.config.report import ReportOfRun
from surgisim.stage import Bytes, Maybe, stage


@stage(
    reads={
        "frames": Frames,
        "camera": Camera,
        "given": Given,
        "masks": Masks,
        "inpainted": Inpainted,
        "depth": Depth,
        "tracks": Tracks,
        "motion": Motion,
        "scene": Scene,
        "deformation": Deformation,
        "rendered": Frames,
        "body": Body,
        "material": Material,
        "physics": Physics,
        "fit": Fit,
        "replay": Replay,
        "metrics": Metrics,
        "truth": Maybe(Truth),
    },
    writes={"report": Bytes(".html"), "yt": Bytes(".png"), "thumbnail": Bytes(".jpg")},
    settings=ReportOfRun,
)
def main(*, material, metrics, truth, settings, progress, **artifacts):
    from surgisim.measure.run import Run
    from surgisim.measure.truth_seen import seen
    from surgisim.report.made import made
    from surgisim.report.page import page
    from surgisim.report.plots import yt_slices
    from surgisim.report.story import Story
    from surgisim.report.thumbnail import thumbnail

    run = Run(**artifacts, truth=truth and seen(truth, artifacts["camera"]))
    story = Story(run, material, metrics, settings)
    told = made(settings.stages, settings.code)
    return page(story, told, progress=progress), yt_slices(story), thumbnail(story)


if __name__ == "__main__":
    main()
