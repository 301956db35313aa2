"""What it takes to weigh one place's hypotheses, by fields with courses and by columns, side by side, as JSON.

    python -m surgisim.diagnosis.benchmark --points 240 --frames 100 --unseen 0.03
    python -m surgisim.diagnosis.benchmark --device cuda

The noise is of every kind (noise.py), fields and nuisances are random: products cost the same whatever they hold.
"""

import argparse
import json
import time

import numpy as np

from surgisim.diagnosis.answers import Answers
from surgisim.diagnosis.metric import metric
from surgisim.diagnosis.noise import Noise, whitener
from surgisim.diagnosis.sight import Sight

STATES, NUISANCES, RESIDUALS = 7, 600, 13
"""As a diagnosis of a measured recording has them."""
KINDS = {"push": (3, 120), "wave": (5, 21)}
"""Causes, and columns."""
TIMES = 5


def random_answers(rng: np.random.Generator, points: int, frames: int, causes: int, columns: int) -> Answers:
    """Of a body that each frame shows in one of its states."""
    share = np.eye(STATES)[np.sort(rng.integers(0, STATES, frames))]
    fields = 1e-3 * rng.standard_normal((causes, STATES, points, 3))
    return Answers(fields, share, rng.uniform(0, 1, (columns, causes, frames)))


def measured(points: int, frames: int, unseen: float, device: str) -> dict[str, float]:
    """Seconds of each, the fastest of TIMES, and how far the two are apart at most, over the largest product."""
    rng = np.random.default_rng(0)
    seen = rng.uniform(size=(points, frames)) >= unseen
    noise = Noise(np.full(points, 2e-4), 0.3, 0.01, 0.05, 0.05, 0.9, 0.5, 0.3, 0.95, 0.3)
    whiten = whitener(noise, 0.02 * rng.standard_normal((points, 3)), seen, device=device)
    open_too = 3e-4 * rng.standard_normal((NUISANCES, points, frames, 3), np.float32)
    sight = Sight(whiten, metric(whiten(open_too).T), seen, device)
    left = sight.of(whiten(2e-4 * rng.standard_normal((RESIDUALS, points, frames, 3), np.float32)).T)
    found = {}
    for name, (causes, columns) in KINDS.items():
        few = random_answers(rng, points, frames, causes, columns)
        sight.products(few, left)
        by_fields, one = _fastest(lambda few=few: sight.products(few, left))
        by_columns, other = _fastest(lambda few=few: sight.products(few.columns, left))
        found |= {f"{name}_by_fields_s": by_fields, f"{name}_by_columns_s": by_columns}
        found[f"{name}_ratio"] = by_columns / by_fields
        found[f"{name}_apart"] = max(
            float(np.abs(a - b).max() / np.abs(b).max()) for a, b in zip(one, other, strict=True)
        )
    return found


def _fastest(work) -> tuple[float, tuple]:
    taken = []
    for _ in range(TIMES):
        began = time.perf_counter()
        result = work()
        taken.append(time.perf_counter() - began)
    return min(taken), result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=240)
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--unseen", type=float, default=0.03, help="share of samples that no track has")
    parser.add_argument("--device", default="cpu")
    asked = vars(parser.parse_args())
    print(json.dumps(asked | measured(**asked), indent=1))


if __name__ == "__main__":
    main()
