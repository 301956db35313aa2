"""Whether the replay stayed a body."""

from typing import Any

from surgisim.measure.number import number
from surgisim.measure.run import Run
from surgisim.measure.sanity import Sanity, sanity


def replay(run: Run) -> dict[str, dict[str, Any]]:
    found = sanity(run.replay, run.body, run.motion, run.camera)
    unit = run.length_unit
    return {
        "smallest_det_f": number(
            found.smallest_volume_ratio,
            "1",
            "over all particles and frames; 0 or less is inside out",
            series=run.replay.smallest_volume_ratio,
        ),
        "largest_displacement": number(1e3 * found.largest, unit, "of a particle, over all frames"),
        "grip_displacement": number(1e3 * found.grip, unit, "largest of a grip's centre while it holds"),
        "displacement_ratio": number(
            found.largest / found.grip if found.grip > 0 else None,
            "1",
            "the two above",
            why_not="no grip drives it",
        ),
        "inside": number(found.inside, "1", "smallest share of the particles seen in frame 0 that stay in the picture"),
        "sane": number(
            float(found.sane),
            "1",
            str(Sanity.sane.__doc__),
        ),
    }
