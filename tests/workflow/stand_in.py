"""A diagnosis that takes no time: it names one law, whatever the recording, and says where and when.

reads   a recording folder
writes  diagnosis.json, physics.json, mismatch.npz
"""

import json
import os

import numpy as np

from surgisim.artifacts.mismatch import Mismatch
from surgisim.config.base import Settings
from surgisim.recordings.folder import read_recording
from surgisim.stage import Bytes, Source, stage


class Anything(Settings):
    model_config = {"extra": "allow"}


@stage(
    reads={"recording": Source("a recording folder"), "work": Source("finished runs", required=False)},
    writes={"diagnosis": Bytes(".json"), "physics": Bytes(".json"), "mismatch": Mismatch, "cloud": Bytes(".ply")},
    settings=Anything,
)
def main(recording, work, *, settings, progress):
    # What a diagnosis must never do: say whether it could see the answer.
    seen = sorted(str(p) for p in recording.parent.rglob("*") if "truth" in p.name and str(recording) in str(p.parent))
    assert not seen, seen
    clip = read_recording(recording)
    rest = clip.attached()
    left = clip.points - rest[:, None]
    z = np.linalg.norm(left, axis=-1) / clip.sigma[:, None]
    particles = clip.body(0.004).rest.astype(float)
    place = {"center": rest.mean(0).tolist(), "extent": 0.006, "unit": "m"}
    told = {
        "format": "surgisim-diagnosis/1",
        "recording": clip.name,
        "verdict": "named",
        "effects": [{"term": os.environ.get("STAND_IN", "fibre"), "probability": 0.7, "place": place}],
        "words": "Something was left out. Nobody looked what.",
    }
    found = Mismatch(
        points=rest,
        residual_before=left,
        residual_after=0.5 * left,
        z=z,
        significant=4.0,
        particles=particles,
        cause=particles[:, 0] - particles[:, 0].min(),
        cause_time=np.nan_to_num(np.nanmean(z, axis=0)),
        phase=np.zeros(clip.frames, int),
    )
    physics = {"terms": {}, "grid": {"spacing": 0.004, "step": 1e-4}}
    return json.dumps(told).encode(), json.dumps(physics).encode(), found, b"ply"


if __name__ == "__main__":
    main()
