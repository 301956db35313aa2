"""Evidence of drawn recordings beside the nulls that were stated, as PNG."""

from typing import Any

import numpy as np

from surgisim.report.charts.paper import png, sheet
from surgisim.report.palette import MUTED, RECONSTRUCTION, REPLAY


def picture(found: dict[str, Any]) -> bytes:
    """Left: shares of evidence and of nulls below a value. Right: where evidence lies among its own nulls."""
    evidence, nulls = np.sort(found["evidence"]), np.sort(np.concatenate(found["nulls"]))
    with sheet(9.0, 3.4) as figure:
        values, places = figure.subplots(1, 2)
        for told, color, label in ((nulls, MUTED, "stated nulls"), (evidence, REPLAY, "drawn recordings")):
            values.step(told, np.arange(1, len(told) + 1) / len(told), color=color, label=label, where="post")
        values.set_xlabel("log evidence of the best law")
        values.set_ylabel("share below")
        place = np.sort(found["place"])
        places.plot([0, 1], [0, 1], color=MUTED, lw=0.9, ls=":")
        places.step(place, np.arange(1, len(place) + 1) / len(place), color=RECONSTRUCTION, where="post")
        places.set_xlabel(f"place among its nulls (Kolmogorov-Smirnov p = {found['ks']['p']:.2g})")
        figure.legend(loc="outside lower center", ncols=2)
        return png(figure)
