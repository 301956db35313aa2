"""Measure what a run achieved: every number with its unit and protocol.

reads   every artifact of the run, the truth where the clip was invented, the grip as tracking
        found it (found) beside that of the fit (motion), benchmark files
writes  metrics.json    Metrics
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
from surgisim.artifacts.metrics import Metrics
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.physics import Physics
from surgisim.artifacts.replay import Replay
from surgisim.artifacts.scene import Scene
from surgisim.artifacts.tracks import Tracks
from surgisim.artifacts.truth import Truth
from surgisim.config.evaluation import Evaluation
from surgisim.stage import Maybe, Source, stage


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
        "physics": Physics,
        "fit": Fit,
        "replay": Replay,
        "truth": Maybe(Truth),
        "found": Maybe(Motion),
        "benchmarks": Source("folder of Snakemake's STAGE.tsv, or such files joined by ':'", required=False),
    },
    writes={"metrics": Metrics},
    settings=Evaluation,
)
def main(*, truth, benchmarks, settings, progress, **artifacts):
    from pathlib import Path

    from surgisim.measure.costs import costs
    from surgisim.measure.lpips import load_lpips
    from surgisim.measure.run import Run
    from surgisim.measure.score import score
    from surgisim.measure.truth_seen import seen

    camera = artifacts["camera"]
    run = Run(**artifacts, truth=truth and seen(truth, camera))
    lpips = load_lpips(Path(settings.lpips_weights)) if settings.lpips_weights else None
    values = score(run, lpips=lpips, first=settings.first_frames, progress=progress)
    return Metrics(settings.clip or camera.source, settings.variant, values, costs(benchmarks) if benchmarks else {})


if __name__ == "__main__":
    main()
