"""What a recording gives away without its paths: sizes, counts, precision. It must not tell the law."""

import json
from pathlib import Path

import numpy as np

FILES = ("recording.json", "rest.ply", "fixed.json", "grip.npz", "tracks.npz", "split.json")


def features(folder: Path) -> dict[str, float]:
    """Numbers that say nothing of how the tissue moves, by name."""
    found = {f"size of {name}": float((folder / name).stat().st_size) for name in FILES if (folder / name).is_file()}
    told = json.loads((folder / "recording.json").read_text())
    found |= {"frames": float(told["frames"]), "fps": float(told["fps"]), "keys": float(len(told))}
    found |= {"density": float(told["density_kg_m3"] or 0.0)}
    with np.load(folder / "tracks.npz", allow_pickle=False) as archive:
        points, visible, sigma = archive["points"], archive["visible"], archive["sigma"]
    known = points[np.isfinite(points)]
    mantissa = known.astype(np.float32).view(np.uint32) & 0x7FFFFF
    return found | {
        "points": float(len(points)),
        "visible": float(visible.mean()),
        "sigma": float(np.mean(sigma)),
        "bytes a number": float(points.dtype.itemsize),
        # Rounded positions end in zeros.
        "last byte zero": float(((mantissa & 0xFF) == 0).mean()),
        "distinct": len(np.unique(known)) / max(len(known), 1),
    }


def tells(rows: list[dict[str, float]], labels: list[str], seed: int = 0, deals: int = 2000) -> dict:
    """How often the nearest other case by `features` has the same label, and how often it would by chance.

    Leave one out; every feature in units of its own spread. p: share of random labellings that do at least as well.
    """
    names = sorted(set.intersection(*(set(r) for r in rows)))
    table = np.array([[r[n] for n in names] for r in rows])
    spread = table.std(0)
    table = (table - table.mean(0))[:, spread > 0] / spread[spread > 0]
    away = np.linalg.norm(table[:, None] - table[None], axis=-1)
    np.fill_diagonal(away, np.inf)
    nearest = away.argmin(1)
    kinds = np.unique(labels, return_inverse=True)[1]
    rng = np.random.default_rng(seed)
    real = float((kinds[nearest] == kinds).mean())
    dealt = np.array([(d[nearest] == d).mean() for d in (rng.permutation(kinds) for _ in range(deals))])
    p = float((1 + (dealt >= real - 1e-12).sum()) / (1 + deals))
    return {"value": real, "chance": float(dealt.mean()), "p": p, "count": len(rows), "features": names}
