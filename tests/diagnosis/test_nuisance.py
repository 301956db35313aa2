"""What a recording leaves open explains itself; noise and nuisances drawn from the model fit it."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from planted import plain
from scipy.linalg import cho_factor
from scipy.stats import chi2

from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis import diagnose, nuisance, perceived
from surgisim.diagnosis.base import Known, carried, displacement_gradient, tracks_of
from surgisim.diagnosis.diagnose import whitened
from surgisim.diagnosis.errors import as_filmed, beside_nuisances, bootstrap, rms
from surgisim.diagnosis.evidence import Finding, Score
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.judgement import borne_out
from surgisim.diagnosis.left_open import drifted, nuisances, told
from surgisim.diagnosis.metric import metric
from surgisim.diagnosis.noise import whitener
from surgisim.diagnosis.nuisance import chosen
from surgisim.diagnosis.prior import SPREAD
from surgisim.diagnosis.self_consistency import drawn

NAMES = (
    "release", "held", "lag", "scale", "drift", "place", "simulator", "grip radius", "grip centre", "grip firmness",
    "uneven grip", "grip path", "elastic law", "closing",
)  # fmt: skip
DIRECTIONS, DRAWS = 300, 12


@pytest.fixture(scope="module")
def case():
    return plain()


@pytest.fixture(scope="module")
def gappy(case):
    """Whitening and metric where a fifth of the samples are missing."""
    clip, rng = case.clip, np.random.default_rng(11)
    seen = rng.random((len(clip.rest), clip.until)) > 0.2
    whiten = whitener(case.noise, clip.rest, seen)
    return whiten, metric(whitened(whiten, case.groups, clip.until)), seen


def residuals(case, whiten, seen) -> np.ndarray:
    """Whitened draws of noise and of nuisances at random prior values, (N, DRAWS)."""
    rng, until, result = np.random.default_rng(12), case.clip.until, []
    for _ in range(DRAWS):
        field = case.noise.draw(case.clip.rest, until, rng)
        for group in case.groups:
            field = field + np.tensordot(rng.standard_normal(len(group.columns)), group.columns[:, :, :until], (0, 0))
        result.append(whiten(np.where(seen[..., None], field, 0.0)))
    return np.stack(result, 1)


def test_what_is_drawn_from_the_model_fits_it_where_a_fifth_is_missing(case, gappy):
    whiten, space, seen = gappy
    z = residuals(case, whiten, seen)
    per_degree = np.diag(space.gram(z, z)) / whiten.free
    assert per_degree == pytest.approx(np.ones(DRAWS), abs=0.1)
    assert per_degree.mean() == pytest.approx(1.0, abs=0.03)


def test_slow_smooth_directions_gain_on_it_what_chance_gives(case, gappy):
    whiten, space, seen = gappy
    clip, rng = case.clip, np.random.default_rng(13)
    time, fields = np.arange(clip.until) / clip.until, []
    for _ in range(DIRECTIONS):
        bump = np.exp(-0.5 * ((clip.rest - rng.choice(clip.rest)) ** 2).sum(1) / rng.uniform(0.004, 0.02) ** 2)
        course = np.sin(2 * np.pi * (rng.uniform(0.3, 2) * time + rng.uniform()))
        fields.append(bump[:, None, None] * course[None, :, None] * rng.standard_normal(3))
    columns = whiten(np.stack(fields)).T
    gains = space.gram(columns, residuals(case, whiten, seen)) ** 2 / np.diag(space.gram(columns, columns))[:, None]
    assert gains.mean() == pytest.approx(1.0, abs=0.2)
    assert gains.max() < chi2.isf(1e-2 / DIRECTIONS / DRAWS, 1)


@pytest.mark.parametrize("name", NAMES)
def test_a_nuisance_at_one_standard_deviation_is_explained_by_its_own_kind_alone(case, name):
    until = case.clip.until
    mine = [g for g in case.groups if g.name == name]
    assert len(mine) == 1
    others = chosen(case.groups, Diagnosing(without=[name]))
    assert len(others) == len(case.groups) - 1
    columns = whitened(case.whiten, mine, until)
    slopes = case.whiten(case.base.slopes).T
    without = metric(np.concatenate([whitened(case.whiten, others, until), slopes], 1))
    beside, left = (np.diag(space.gram(columns, columns)) for space in (without, case.space))
    # One direction of unit variance leaves b / (1 + b) of a chi square of b: below 1, however large the nuisance is.
    assert (left <= 1.01 * beside / (1 + beside)).all()


def test_a_grip_that_the_grid_widens_may_be_smaller_by_as_much(case):
    clip = case.clip
    motion = replace(clip.motion, radius=0.4 * clip.body.spacing * np.ones(len(clip.motion.radius)))
    clip = replace(clip, recording=replace(clip.recording, motion=motion))
    base = replace(case.base, simulated=tracks_of(clip, case.base.x, case.memo))
    group = next(g for g in nuisance.other_bodies(clip, base, case.memo, 1) if g.name == "grip radius")
    assert group.values[0][1] == pytest.approx(np.hypot(nuisance.RADIUS, 0.25))
    assert np.abs(group.columns[0]).max() > 1e-4


def test_what_the_first_grip_shows_of_the_jaws_holds_for_the_second(case):
    rng = np.random.default_rng(21)
    first, second = np.zeros((2, 6, 10, 3))
    first[:, :5], second[:, 5:] = rng.standard_normal((2, 6, 5, 3))
    named = (("radius of grip 0", nuisance.RADIUS, "1"), ("radius of grip 1", 2 * nuisance.RADIUS, "1"))
    radius = nuisance._of_one_instrument(nuisance.Group("grip radius", np.stack([first, 2 * second]), named))
    assert radius.values == named
    seen = radius.columns[:, :, :5].reshape(3, -1).T
    # Both grips are 20 % too small, and fitted frames show the first alone.
    amount = np.linalg.solve(100 * seen.T @ seen + np.eye(3), 100 * seen.T @ (-2 * first[:, :5]).ravel())
    foretold = np.tensordot(amount, radius.columns, 1)[:, 5:]
    assert foretold == pytest.approx(-second[:, 5:], rel=0.02)
    alone = nuisance.Group("grip radius", first[None], named[:1])
    assert nuisance._of_one_instrument(alone) is alone


def test_points_that_sit_beside_where_they_are_taken_to_be_are_explained(case):
    clip, until, prepared, run = case.clip, case.clip.until, case.base.prepared, case.base.run
    loose = replace(case.noise, level=10 * case.noise.level)
    by = 10 * case.noise.sigma * np.random.default_rng(14).standard_normal(clip.rest.shape)
    off = carried(prepared.simulator.carry(clip.rest + by), run) - case.base.simulated
    white = case.whiten(off[:, :until])[:, None]
    group = nuisance.places(clip, displacement_gradient(prepared, clip, run), loose)
    assert 0 < len(group.columns) <= nuisance.MOST_PLACES
    assert (np.abs(group.columns).max((2, 3)) > 0).sum(1).max() == 1
    space = metric(whitened(case.whiten, [group], until))
    assert space.gram(white, white) < 0.25 * (white**2).sum()


def test_a_stiffness_that_is_hardly_told_is_said_with_where_it_may_lie(case):
    def said(sharper: float) -> list[str]:
        known = Known(np.diag((SPREAD * [sharper, 0.5, 0.5]) ** 2), np.zeros((400, 3)))
        return [text for text in told(replace(case, base=replace(case.base, known=known, bound=()))) if "E is" in text]

    assert said(0.5) == []
    (sentence,) = said(0.9)
    low, high = (1e3 * float(number) for number in re.findall(r"[\d.]+", sentence)[:2])
    # 90 % of a spread of .9 times 1.2 in log E lie within a factor of 5.9 either way.
    assert np.log(high / low) == pytest.approx(2 * 1.645 * 0.9 * SPREAD[0], rel=0.2)


def test_a_camera_that_drifts_is_said(case):
    case = case.drifting(np.full(3, nuisance.DRIFT))
    assert not any("camera drifts" in said for said in told(case))
    until = case.clip.until
    drift = next(g for g in case.groups if g.name == "drift")
    field = 8.0 * drift.columns[0]
    pushed = replace(case, z=case.z + case.whiten(field[:, :until]))
    size = np.sqrt((field[:, until - 1] ** 2).sum(1).mean())
    assert drifted(pushed) == pytest.approx(size, rel=0.35)
    assert any(said.startswith("Not tissue: the camera drifts by ") for said in told(pushed))
    row = next(r for r in nuisances(pushed) if r["name"] == "camera drift by the end")
    assert row["value"] == drifted(pushed)


def test_what_a_case_draws_is_like_its_recording(case):
    until, rng = case.clip.until, np.random.default_rng(3)
    fitted, ahead = [], []
    freedom = [case.whiten.free, case.prospect.whiten_all.free - case.whiten.free]
    for _ in range(DRAWS):
        moved = drawn(case, rng)
        assert moved.shape == case.clip.moved.shape
        z = case.whiten((moved - case.base.simulated)[:, :until])[:, None]
        fitted.append(case.space.gram(z, z)[0, 0] / freedom[0])
        ahead.append(case.prospect.misfit(moved - case.base.simulated).sum() / freedom[1])
    assert np.mean(fitted) == pytest.approx(1.0, abs=0.05)
    assert np.mean(ahead) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(("evidence", "steadier"), [(90.0, True), (4.0, False)])
def test_a_drift_and_a_law_that_moves_the_whole_picture_are_weighed_together(monkeypatch, evidence, steadier):
    case = plain().drifting(np.full(3, 2e-3))
    finding = Finding(
        Hypothesis("respiration", np.eye(1)), evidence, np.ones(1), np.ones(1), 90.0, np.zeros(1), 0, 1e-4
    )
    law = SimpleNamespace(response=1e-4 * np.ones_like(case.clip.moved))
    monkeypatch.setattr(diagnose, "refit", lambda *_: law)
    found = diagnose.steadied(case, {"respiration": Score(evidence, np.zeros(1), [finding])}, lambda *_: None)
    if not steadier:
        assert found is None
        return
    # Nothing drifts there: the likelihood of the fitted frames says so, and nulls and columns follow.
    assert (found.drift < 0.15 * case.drift).all()
    mine = nuisance.span(case.groups, "drift")
    assert found.space.columns[:, mine] / nuisance.by_part(found.drift) == pytest.approx(
        case.space.columns[:, mine] / nuisance.by_part(case.drift), rel=1e-4, abs=1e-3
    )
    assert (found.nulls**2).sum() < (case.nulls**2).sum()


def test_a_drift_is_learned_from_all_fitted_frames_part_by_part(case):
    until, rng = case.clip.until, np.random.default_rng(31)
    steps = 1e-3 / np.sqrt(case.clip.frames) * rng.standard_normal((case.clip.frames, 3))
    walk = np.broadcast_to(np.cumsum(steps, 0), case.clip.moved.shape)
    noise = case.noise.draw(case.clip.rest, case.clip.frames, rng)
    walked = replace(case, z=case.whiten((walk + noise)[:, :until]))
    likeliest = walked.likeliest_drift()
    assert 4e-4 < likeliest[0] < 2e-3
    assert likeliest[1:].max() < 2.5e-4
    assert replace(case, z=case.whiten(noise[:, :until])).likeliest_drift().max() < 2.5e-4


def test_what_the_camera_did_is_no_misfit(case):
    clip, rng = case.clip, np.random.default_rng(33)
    steps = 1e-3 / np.sqrt(clip.frames) * rng.standard_normal((clip.frames, 3))
    walk = np.cumsum(steps, 0)[None] * clip.seen[..., None]
    walked = replace(case, clip=replace(clip, moved=clip.moved + walk)).drifting(np.array([1e-3, 1e-4, 1e-4]))
    still, plain, aside = (
        np.array(rms(*told))
        for told in (
            (case, case.base.simulated), (walked, case.base.simulated),
            (walked, as_filmed(walked, case.base.simulated)),
        )
    )  # fmt: skip
    assert (plain > 1.3 * still).all()
    assert aside == pytest.approx(still, rel=0.15)


def columns(case) -> np.ndarray:
    return np.concatenate([g.columns for g in case.groups])


def test_the_plain_error_bears_out_what_is_there_and_nothing_else(case):
    clip, base = case.clip, case.base.simulated
    across = clip.rest[:, 0] / np.ptp(clip.rest[:, 0])
    course = np.clip(np.linspace(-0.5, 1.5, clip.frames), 0, 1)
    bump = 2e-4 * np.cos(4 * np.pi * across)[:, None, None] * course[:, None] * np.array([0.0, 0.6, 0.8])
    there = replace(case, clip=replace(clip, moved=clip.moved + bump * clip.seen[..., None]))
    assert borne_out(there, base + bump) == pytest.approx(1.0, abs=0.4)
    assert borne_out(there, base + 0.5 * bump) > 2.0
    assert borne_out(case, base + bump) == pytest.approx(-1.0, abs=0.4)
    assert borne_out(case, base) == -1.0
    # Beside a grip that is larger by three standard deviations, which is far more than what is there.
    (wide,) = (3 * g.columns[0] for g in case.groups if g.name == "grip radius")
    assert (wide[:, : clip.until] ** 2).sum() > 10 * (bump[:, : clip.until] ** 2).sum()
    both = replace(there, clip=replace(clip, moved=there.clip.moved + wide * clip.seen[..., None]))
    assert borne_out(both, base + bump) == pytest.approx(1.0, abs=0.4)
    # So do frames held out, where a nuisance hides it from the plain error itself.
    later = bump[:, clip.until :] * clip.seen[:, clip.until :, None]
    size, *overlaps = ((c[:, clip.until :] * later).sum() for c in (bump, *columns(case)))
    most = int(np.abs(overlaps).argmax())
    hidden = -2 * size / overlaps[most] * columns(case)[most]
    against = replace(there, clip=replace(clip, moved=there.clip.moved + hidden * clip.seen[..., None]))
    plain = bootstrap(against, base, base + bump)
    beside = bootstrap(against, *(beside_nuisances(against, s, whole=True) for s in (base, base + bump)))
    assert sum(plain) < 0
    assert beside[0] > 0.5 * plain[0]


def test_laws_owe_what_the_base_loses_where_the_camera_may_drift_less(case):
    until, rng = case.clip.until, np.random.default_rng(32)
    walk = np.cumsum(1e-4 * rng.standard_normal((case.clip.frames, 3)), 0)
    noise = case.noise.draw(case.clip.rest, case.clip.frames, rng)
    walked = replace(case, z=case.whiten((walk + noise)[:, :until]))
    # Ratios are those of the covariance as it is built anew for each size.
    likeliest = walked.likeliest_drift()
    small, large = (walked.drifting(likeliest * [times, 1, 1]) for times in (0.1, 1.5))
    plain = [-0.5 * (c.misfit + c.space.log_det) + nuisance.drift_prior(c.drift).sum() for c in (small, large)]
    assert small.behind - large.behind == pytest.approx(plain[1] - plain[0], rel=1e-2)
    assert walked.drifting(likeliest).behind == 0.0
    assert large.behind < 5.0 < 30.0 < small.behind
    # A law that moves tissue like the camera leaves little for the camera.
    law = case.whiten(np.broadcast_to(walk, case.clip.moved.shape)[:, :until])
    assert walked.likeliest_drift(law)[0] < 0.5 * likeliest[0]


def test_the_log_determinant_of_a_metric_is_that_of_its_covariance():
    U = np.random.default_rng(0).normal(size=(7, 3))
    assert metric(U).log_det == pytest.approx(np.linalg.slogdet(np.eye(7) + U @ U.T)[1], rel=1e-5)


def test_what_perception_left_open_is_no_misfit(case):
    clip, until = case.clip, case.clip.until
    course = np.clip((np.arange(clip.frames) - 4) / 5, 0, 1)[None, :, None]
    away = np.linalg.norm(clip.recording.place - clip.motion.center_rest[0], axis=1)
    deeper = 2e-3 * np.exp(-0.5 * (away / 0.01) ** 2)[:, None, None] * course * [0.6, 0.0, 0.8]
    told = replace(clip, recording=replace(clip.recording, doubts={"held.depth": deeper}))
    group = perceived.doubted(told)
    assert group.values == (("held.depth", 1.0, "standard deviations"),)
    assert not len(perceived.doubted(clip).columns)
    white = case.whiten(deeper[clip.kept][:, :until])[:, None]
    found = {}
    for name, groups in (("told", [*case.groups, group]), ("not", case.groups)):
        found[name] = metric(whitened(case.whiten, groups, until)).gram(white, white)[0, 0]
    assert found["told"] < 1.1 < 100 < found["not"]


def test_directions_that_are_large_and_alike_are_told_in_double_precision():
    one = np.random.default_rng(8).standard_normal((6000, 1))
    apart = np.random.default_rng(9).standard_normal((6000, 20))
    U = (3e4 * (one + 1e-6 * apart)).astype(np.float32)
    with pytest.raises(np.linalg.LinAlgError):
        cho_factor(np.eye(20) + (U.T @ U).astype(float))
    exact = np.eye(20) + U.T.astype(float) @ U.astype(float)
    assert metric(U).log_det == pytest.approx(np.linalg.slogdet(exact)[1], rel=1e-3)
