"""Measure a scene alone: pictures, and whether it moves as tissue does.

reads   what a scene was made of and what it became, the truth where the clip was invented, benchmark files
writes  metrics.json    Metrics, of the groups reconstruction and scene
        surface.png     its surface where most of it is turned over, and its splats at rest
"""

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.deformation import Deformation
from surgisim.artifacts.depth import Depth
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.artifacts.inpainted import Inpainted
from surgisim.artifacts.masks import Masks
from surgisim.artifacts.metrics import Metrics
from surgisim.artifacts.scene import Scene
from surgisim.artifacts.tracks import Tracks
from surgisim.artifacts.truth import Truth
from surgisim.config.scene_score import SceneScore
from surgisim.stage import Bytes, Maybe, Source, stage


@stage(
    reads={
        "frames": Frames,
        "camera": Camera,
        "given": Given,
        "masks": Masks,
        "inpainted": Inpainted,
        "depth": Depth,
        "tracks": Tracks,
        "scene": Scene,
        "deformation": Deformation,
        "rendered": Frames,
        "truth": Maybe(Truth),
        "benchmarks": Source("folder of Snakemake's STAGE.tsv, or such files joined by ':'", required=False),
    },
    writes={"metrics": Metrics, "picture": Bytes(".png")},
    settings=SceneScore,
)
def main(*, truth, benchmarks, settings, progress, **artifacts):
    from pathlib import Path

    from surgisim.measure.costs import costs
    from surgisim.measure.lpips import load_lpips
    from surgisim.measure.run import OfScene
    from surgisim.measure.score import score_scene
    from surgisim.measure.truth_seen import seen
    from surgisim.report.charts.surface import surface

    camera = artifacts["camera"]
    made = OfScene(**artifacts, truth=truth and seen(truth, camera))
    lpips = load_lpips(Path(settings.lpips_weights)) if settings.lpips_weights else None
    values = score_scene(made, lpips=lpips, first=settings.first_frames, seed=settings.seed)
    name, made_in = settings.clip or camera.source, costs(benchmarks) if benchmarks else {}
    return Metrics(name, settings.variant, values, made_in), surface(made, f"{name}, {settings.variant}")


if __name__ == "__main__":
    main()
