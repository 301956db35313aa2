"""Put a run on one page: films, every stage's pictures, curves, tables, and what to distrust.

reads   every artifact of the run, and metrics.json
writes  report.html     one file, nothing outside it
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
from surgisim.config.report import Report
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
    writes={"report": Bytes(".html")},
    settings=Report,
)
def main(*, material, metrics, truth, settings, progress, **artifacts):
    from surgisim.measure.run import Run
    from surgisim.measure.truth_seen import seen
    from surgisim.report.page import page
    from surgisim.report.story import Story

    run = Run(**artifacts, truth=truth and seen(truth, artifacts["camera"]))
    return page(Story(run, material, metrics, settings), progress=progress)


if __name__ == "__main__":
    main()
