"""Backends of depth beside a depth that came with the recording, as JSON.

    python -m surgisim.proof.depths results/CLIP/main --backends near_light stereo

Mean of |z - z_given| / z_given over tissue in all frames, after one factor for the clip; and, as something to beat,
that of the plane which fits each frame's given depth best, and so knows what the backends do not. Beside that how far
the change of depth since frame 0 is off, of tissue that is seen to move: root mean square over that of the given one.
A depth that is only shown, as colours in a panel of a film, is read with --film, --panel and --range.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from scipy.spatial import cKDTree

from surgisim.artifacts.base import load
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.correspondence import Correspondence
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.artifacts.inpainted import Inpainted
from surgisim.artifacts.masks import Masks
from surgisim.config.depth import Depth
from surgisim.measure.compared import from_start, moving
from surgisim.measure.depth_error import depth_error, scale_between
from surgisim.measure.groups.depth_change import sampled
from surgisim.perception.depth.distance import depth
from surgisim.perception.ingest.video import opened
from surgisim.problem import Problem

ROUNDS, LEAST = 30, 1e-3
"""Rounds of weights, and the error below which it no longer matters which is smaller [1]."""
STRIDE = 4
"""Pixels of frame 0 from one that is followed to the next."""
SURE = 1.0
"""Doubt about where a pixel is, below which it counts [px]."""
FOREIGN = 40.0
"""Distance from the colour map's colours from which one is none of them [0-255]."""
MOST_PIXELS = 100_000_000


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


def change_off(found: np.ndarray, given: np.ndarray, counted: np.ndarray, surface: Correspondence) -> float:
    """Error of the change of depth since frame 0, of tissue that is seen to move, as a share of that change [%]; every
    STRIDE-th pixel of frame 0 is followed while it is surely seen, and one factor taken out for the clip."""
    row, column = (a.ravel() for a in np.mgrid[: given.shape[1] : STRIDE, : given.shape[2] : STRIDE])
    xy = np.stack([surface.position(t)[row, column] for t in range(len(given))], 1).astype(float)
    sure = np.stack([(surface.seen[t] & (surface.error[t] < SURE))[row, column] for t in range(len(given))], 1)
    known = np.nan_to_num(sampled(counted.astype(float), xy)) > 0.99
    there = sure & known & known[:, :1]
    there &= moving(from_start(xy), there, there.any(1))
    wanted, ours = (from_start(sampled(z, xy))[there] for z in (given, found * scale_between(found, given, counted)))
    if not wanted.any():
        return float("nan")
    return round(100 * float(np.linalg.norm(ours - wanted) / np.linalg.norm(wanted)), 1)


def panel_depth(film: Path, panel: list[int], shown: list[float], shape: tuple[int, int, int]) -> np.ndarray:
    """Depth [m] that a film's panel (x, y, width, height) [px] shows as OpenCV's JET from the nearest to the farthest
    shown [m], (T, H, W); 0 where its colour is none of the map's, as under a title, and around there.

    Raises Problem for a film of another length."""
    x, y, width, height = panel
    colours = cv2.applyColorMap(np.arange(256, dtype=np.uint8)[:, None], cv2.COLORMAP_JET)[:, 0, ::-1]
    tree, found = cKDTree(colours.astype(float)), np.zeros(shape)
    count = 0
    for t, rgb in enumerate(opened(film, max_pixels=MOST_PIXELS).frames()):
        count = t + 1
        if count > len(found):
            continue
        away, k = tree.query(rgb[y : y + height, x : x + width].reshape(-1, 3).astype(float))
        z = (shown[0] + (shown[1] - shown[0]) * k / 255).reshape(height, width)
        known = cv2.erode((away < FOREIGN).reshape(height, width).astype(np.uint8), np.ones((5, 5), np.uint8))
        z, known = (cv2.resize(a, shape[:0:-1], interpolation=cv2.INTER_NEAREST) for a in (z, known))
        found[t] = np.where(known, z, 0.0)
    if count != len(found):
        raise Problem(
            f"{film}: has {count} frames, and the clip {len(found)}: they are compared one by one. Ingest every frame."
        )
    return found


def compared(home: Path, backends: list[str], panel: dict[str, Any] | None = None) -> dict[str, Any]:
    """Each backend's errors and the plane's; panel: arguments of `panel_depth` for a depth that is only shown. Raises
    Problem where no depth was given."""
    given = load(Given, home / "ingest" / "given.npz")
    masks = load(Masks, home / "masking" / "masks.npz")
    known = panel_depth(**panel, shape=masks.tissue.shape) if panel else given.depth
    if not len(known):
        raise Problem(
            f"{home}: no depth came with this recording, so there is nothing to compare with. Pass one that has."
        )
    frames, camera = load(Frames, home / "ingest" / "frames.npz"), load(Camera, home / "ingest" / "camera.json")
    inpainted = load(Inpainted, home / "inpainting" / "inpainted.npz")
    surface = load(Correspondence, home / "correspondence" / "correspondence.npz")
    counted = masks.tissue & (known > 0)
    planes = np.stack([plane(z, m) for z, m in zip(known, counted, strict=True)])
    errors, changes = {"plane": off(planes, known, counted)}, {}
    for backend in backends:
        z = depth(frames, inpainted, masks, surface, given, camera, Depth(backend=backend)).z.astype(float)
        errors[backend], changes[backend] = off(z, known, counted), change_off(z, known, counted, surface)
        print(f"{backend} {errors[backend]} %, change {changes[backend]} %", file=sys.stderr, flush=True)
    return {"relative": errors, "change": changes}


def main() -> None:
    cli = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    cli.add_argument("results", type=Path, help="a clip's folder with ingest/ to correspondence/")
    cli.add_argument("--backends", nargs="+", default=["near_light"], help="of depth")
    cli.add_argument("--film", type=Path, help="a film that shows depth as colours")
    cli.add_argument("--panel", type=int, nargs=4, metavar=("X", "Y", "WIDTH", "HEIGHT"), help="where [px]")
    cli.add_argument("--range", type=float, nargs=2, metavar=("NEAR", "FAR"), help="what the colours span [m]")
    args = cli.parse_args()
    asked = [args.film, args.panel, args.range]
    if any(asked) != all(asked):
        cli.error("--film, --panel and --range are one: pass all three or none.")
    panel = {"film": args.film, "panel": args.panel, "shown": args.range} if args.film else None
    json.dump({"unit": "%", **compared(args.results, args.backends, panel)}, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
