"""Backends of depth beside a depth that came with the recording, as JSON.

    python -m surgisim.proof.depths results/CLIP/main --backends near_light stereo

Mean of |z - z_given| / z_given over tissue in all frames, after one factor for the clip; and, as something to beat,
that of the plane which fits each frame's given depth best, and so knows what the backends do not.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

from surgisim.artifacts.base import load
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.correspondence import Correspondence
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.artifacts.inpainted import Inpainted
from surgisim.artifacts.masks import Masks
from surgisim.config.depth import Depth
from surgisim.measure.depth_error import depth_error, scale_between
from surgisim.perception.depth.distance import depth
from surgisim.problem import Problem

ROUNDS, LEAST = 30, 1e-3
"""Rounds of weights, and the error below which it no longer matters which is smaller [1]."""


def plane(z: np.ndarray, counted: np.ndarray) -> np.ndarray:
    """The plane in space whose relative distance from depth [m], (H, W), is least where it counts: 1 / z is linear in
    pixels. Least absolute errors by weights over and over, since a few depths that came with recordings are absurd."""
    row, column = np.indices(z.shape)
    basis = np.stack([np.ones(z.shape), column / max(z.shape), row / max(z.shape)], -1)
    # z over the plane's is 1 where they agree.
    rows = basis[counted] * z[counted, None].astype(float)
    weight = np.ones(len(rows))
    for _ in range(ROUNDS):
        fitted = np.linalg.lstsq(rows * weight[:, None], weight, rcond=None)[0]
        weight = np.maximum(abs(rows @ fitted - 1), LEAST) ** -0.5
    return 1 / (basis @ fitted)


def off(found: np.ndarray, given: np.ndarray, counted: np.ndarray) -> float:
    """Mean absolute relative error [%] after one factor."""
    error = depth_error(found, given, counted, scale=scale_between(found, given, counted))
    return round(100 * error.relative, 2) if error else float("nan")


def compared(home: Path, backends: list[str]) -> dict[str, float]:
    """Each backend's error and the plane's. Raises Problem where no depth was given."""
    given = load(Given, home / "ingest" / "given.npz")
    if not len(given.depth):
        raise Problem(
            f"{home}: no depth came with this recording, so there is nothing to compare with. Pass one that has."
        )
    frames, camera = load(Frames, home / "ingest" / "frames.npz"), load(Camera, home / "ingest" / "camera.json")
    masks = load(Masks, home / "masking" / "masks.npz")
    inpainted = load(Inpainted, home / "inpainting" / "inpainted.npz")
    surface = load(Correspondence, home / "correspondence" / "correspondence.npz")
    counted = masks.tissue & (given.depth > 0)
    planes = np.stack([plane(z, m) for z, m in zip(given.depth, counted, strict=True)])
    errors = {"plane": off(planes, given.depth, counted)}
    for backend in backends:
        z = depth(frames, inpainted, masks, surface, given, camera, Depth(backend=backend)).z
        errors[backend] = off(z, given.depth, counted)
        print(backend, errors[backend], file=sys.stderr, flush=True)
    return errors


def main() -> None:
    cli = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    cli.add_argument("results", type=Path, help="a clip's folder with ingest/ to correspondence/")
    cli.add_argument("--backends", nargs="+", default=["near_light"], help="of depth")
    args = cli.parse_args()
    json.dump({"unit": "%", **compared(args.results, args.backends)}, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
