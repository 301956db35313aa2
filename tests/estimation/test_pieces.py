"""Tissue that goes along with a grip is parted from what it slides past, where that fits far better."""

from dataclasses import replace

import numpy as np
import pytest
from slab import pulled, slab
from slab_clip import CAMERA, FPS, QUICK, TRUE, T, alone, clip, silent

from surgisim.artifacts.tracks import Tracks
from surgisim.config.estimation import Estimation
from surgisim.estimation.fit import estimate
from surgisim.estimation.lay import upright
from surgisim.estimation.pieces import seen_piece
from surgisim.mpm.setup import prepare

ROOT, HALF = -0.012, 0.006
"""Where a strip along x hangs on the slab, and half of its width [m]."""


def strip(rest: np.ndarray) -> np.ndarray:
    return (np.abs(rest[..., 1]) < HALF) & (rest[..., 0] > ROOT)


def tracks_of(xyz: np.ndarray) -> Tracks:
    """Points that go so, (K, T, 3) [m]."""
    k = xyz.shape[:2]
    return Tracks(
        CAMERA.project(xyz).astype(np.float32), np.ones(k, bool), np.full(k, 0.1, np.float32), xyz.astype(np.float32),
        np.full((*k, 2), 3e-5, np.float32),
    )  # fmt: skip


def gripped(by=(0.0, 0.008, -0.003)):
    """A pull near the strip's end."""
    motion, center = pulled(frames=T, hold=9, by=by), np.array([[0.015, 0.0, 0.06]])
    way = motion.position - motion.center_rest[:, None]
    return replace(motion, center_rest=center, position=center[:, None] + way, radius=np.array([0.0055]))


def swung(far: float) -> np.ndarray:
    """A strip whose end goes `far` [m] aside and whose root stays, beside tissue that does not move, (K, T, 3) [m]."""
    body = slab()
    rest = body.rest[body.surface].astype(float)
    share = np.clip((rest[:, 0] - ROOT) / 0.02, 0, 1) * strip(rest)
    return rest[:, None] + np.linspace(0, far, T)[None, :, None] * share[:, None, None] * [0.0, 1.0, 0.0]


def test_what_swings_aside_is_a_piece_with_walls_along_it_and_none_at_its_root():
    columns = upright(slab(), CAMERA)
    piece = seen_piece(columns, tracks_of(swung(0.010)), gripped())
    moved = columns.xy[piece.loose]
    assert strip(np.column_stack([moved, moved])).all()
    assert len(moved) > 0.5 * strip(columns.xy).sum()
    along = np.isclose(np.abs(piece.walls[..., 1]), HALF, atol=1e-6).all(1)
    assert along.mean() > 0.8
    assert np.ptp(piece.walls[along][..., 1]) == pytest.approx(2 * HALF, abs=1e-6)
    assert piece.walls[..., 0].min() > ROOT + 0.005
    # Tissue beyond the picture is parted as well.
    assert piece.walls[..., 0].max() > columns.xy[:, 0].max() + 0.05


def test_tissue_that_is_dragged_along_evenly_is_in_one_piece():
    columns, rest = upright(slab(), CAMERA), slab().rest[slab().surface].astype(float)
    near = np.exp(-(np.linalg.norm(rest[:, :2] - [0.015, 0.0], axis=1) ** 2) / (2 * 0.012**2))
    xyz = rest[:, None] + np.linspace(0, 0.004, T)[None, :, None] * near[:, None, None] * [0.0, 1.0, 0.0]
    piece = seen_piece(columns, tracks_of(xyz), gripped())
    assert piece is None or not len(piece.walls)
    whole = rest[:, None] + np.linspace(0, 0.004, T)[None, :, None] * [0.0, 1.0, 0.0]
    assert seen_piece(columns, tracks_of(whole), gripped()) is None


def test_what_moves_away_from_the_grip_is_not_its_piece():
    elsewhere = replace(gripped(), center_rest=np.array([[-0.02, -0.015, 0.06]]))
    assert seen_piece(upright(slab(), CAMERA), tracks_of(swung(0.010)), elsewhere) is None


def test_a_loose_piece_is_held_by_nothing_and_hangs_together_over_a_step():
    columns = upright(slab(), CAMERA)
    loose = strip(columns.xy)
    step = columns.xy[:, 0] > 0.006
    columns = replace(
        columns, loose=loose, begin=columns.begin - 0.02 * step, above=columns.above - 0.02 * step
    )  # fmt: skip
    body = columns.laid(0.009, rim=True)
    held = body.held & strip(body.rest)
    assert not held.any()
    assert body.held.any()
    beside = strip(body.rest) & (body.rest[:, 0] > 0.006) & (body.rest[:, 0] < 0.012)
    apart = ~strip(body.rest) & (body.rest[:, 0] > 0.006) & ~body.held
    # A free column ends as deep below its own surface as any, unless what it hangs on lies deeper.
    assert body.rest[beside, 2].max() > 0.06
    assert body.rest[apart, 2].max() < 0.06


@pytest.fixture(scope="module")
def swinging():
    """What stages hand over of a strip that hangs on a slab by its root alone and is pulled aside."""
    case, motion, fine = list(clip()), gripped(), slab(spacing=0.003)
    held = (fine.rest[:, 2] > 0.075) & ~strip(fine.rest)
    walls = np.array([[[ROOT, y], [0.03, y]] for y in (-HALF, HALF)])
    fine = replace(fine, held=held, torn=walls)
    made = prepare(fine, tuple(TRUE), density=1050.0, grips=motion)
    drive = made.drive(motion, TRUE, fps=FPS, per_frame=2 * made.per_frame(TRUE, FPS), held=held, firm=False)
    points = case[0].rest[case[0].surface].astype(float)
    carry = made.simulator.carry(points)
    xyz = np.stack([points + carry @ u.astype(float) for u in made.simulator.run(made.theta(TRUE), drive).u], 1)
    noise = np.random.default_rng(0).normal(0, 3e-5, xyz.shape)
    case[2], case[3] = tracks_of(xyz + np.where(np.arange(T)[:, None] > 0, noise, 0.0)), motion
    return case


@pytest.mark.slow(110)
def test_a_strip_is_told_from_the_block_it_lies_on(swinging, monkeypatch):
    alone(monkeypatch)
    found = estimate(*swinging, Estimation(**QUICK | {"iterations": 1}), silent)
    costs = {h["as"]: h["cost"] for h in found.fit.history if h["round"] == "hold" and "grip" not in h}
    without = next(h["without"] for h in found.fit.history if h["round"] == "hold")
    assert costs["parted piece"] < 0.5 * min([without, *(c for name, c in costs.items() if name != "parted piece")])
    assert len(found.body.torn)
    assert not (found.body.held & strip(found.body.rest) & (found.body.rest[:, 0] > 0)).any()
    assert "slides past what lies beside it" in found.fit.words
