"""The paper's tables from finished runs."""

import csv
import io
import math

import numpy as np
import pytest
from PIL import Image

from surgisim.artifacts.metrics import Metrics
from surgisim.problem import Problem
from surgisim.proof.tables import digest_of, tables
from surgisim.report.board.tables import as_csv, as_markdown, page


def entry(value):
    return {"value": value, "unit": "1", "protocol": ""}


def run(clip, variant, psnr):
    driven = {f"{kind}_driven": entry(value) for kind, value in (("psnr", psnr), ("ssim", 0.8), ("lpips", 0.1))}
    stages = {"ingest": {"seconds": 2.0, "peak_mb": 100.0}, "depth": {"seconds": 3.0, "peak_mb": 900.0}}
    stages |= {"reconstruction": {"seconds": 40.0, "peak_mb": 700.0}, "estimation": {"seconds": 60.0}}
    return Metrics(clip, variant, {"simulation": driven | {"psnr_whole_all": entry(psnr - 3)}}, stages)


def scene(clip, variant, seed, psnr):
    numbers = {"seed": entry(seed), "psnr_first_25": entry(psnr), "psnr_between": entry(psnr - 2)}
    return Metrics(clip, variant, {"reconstruction": numbers, "scene": {"folded": entry(1.0)}}, {})


@pytest.fixture
def found():
    runs = [run(c, v, p) for c, k in (("a", 0), ("b", 2)) for v, p in (("main", 24 + k), ("mesh", 20 + k))]
    rng = np.random.default_rng(0)
    scenes = []
    for clip in "ab":
        for seed in range(3):
            psnr = 36 + rng.normal()
            scenes += [scene(clip, "main", seed, psnr), scene(clip, "no_both", seed, psnr - 0.5 + 0.01 * seed)]
            beside = 0.1 if clip == "a" else -0.1
            scenes += [scene(clip, "no_trajectory", seed, psnr + beside + 0.001 * seed)]
    return tables(runs, [*scenes, scene("a", "near_light", 0, 30.0)], {"seeds": [0, 1, 2]})


def table(found, name):
    return next(t for t in found["tables"] if t["name"] == name)


def test_variants_are_rows_with_their_clips_and_a_mean(found):
    rows = {r["name"]: r["cells"] for r in table(found, "simulation")["rows"]}
    assert [n for n in rows if "mean" in n] == [
        "ours, mean of 2 clips", "triangle mesh, masses and springs, mean of 2 clips",
    ]  # fmt: skip
    assert rows["ours, b"][0]["value"] == 26
    # Nothing was let go, and nobody says so with a number.
    assert rows["ours, b"][3]["value"] is None
    middle = rows["ours, mean of 2 clips"][0]
    # Student's, one degree of freedom, at .95: 6.314 standard errors, each of 1 dB.
    assert (middle["value"], middle["high"]) == pytest.approx((25, 25 + 6.3138), abs=1e-3)


def test_terms_are_judged_against_ours_of_the_same_clip_and_seed(found):
    environment = table(found, "environment")
    rows = {r["name"]: r["cells"][3] for r in environment["rows"]}
    assert rows["ours"]["value"] is None
    # Scenes differ by 1 dB from seed to seed, pairs by hundredths.
    assert rows["without both"]["value"] == pytest.approx(-0.49)
    assert rows["without both"]["high"] < -0.45
    # Two clips that differ by .2 dB tell no more for three seeds each that agree.
    apart = rows["without trajectory term"]
    assert (apart["value"], apart["high"]) == pytest.approx((0.001, 0.001 + 6.3138 * 0.1), abs=1e-4)
    words = environment["words"]
    assert "without both (-0.36 dB printed): worse, as printed" in words
    assert "without trajectory term (-0.08 dB printed): no difference that can be told" in words
    assert "without anisotropic term (-0.53 dB printed): cannot tell" in words


def test_scenes_of_the_first_seed_stand_in_the_table_of_reconstructions(found):
    rows = {r["name"]: r["cells"][0]["value"] for r in table(found, "reconstruction")["rows"]}
    assert list(rows) == ["a", "a, depth by light", "b"]
    assert rows["a, depth by light"] == 28


def test_costs_are_of_the_main_run(found):
    (first, _) = table(found, "costs")["rows"]
    values = [c["value"] for c in first["cells"]]
    assert values == [5, 40, None, 60, None, 105, 900]


def test_the_forms_say_the_same(found):
    rows = list(csv.DictReader(io.StringIO(as_csv(found).decode())))
    told = [
        r for r in rows if (r["table"], r["row"], r["column"]) == ("simulation", "ours, b", "PSNR [dB], grip holds")
    ]
    assert [float(r["value"]) for r in told] == [26]
    assert {r["printed"] for r in rows} == {"yes", "no"}
    text, html = as_markdown(found).decode(), page(found).decode()
    for form in (text, html):
        assert "26.0" in form
        assert "22.4" in form
        assert "–" in form
        assert "no difference that can be told" in form
    assert "nan" not in text.lower()
    assert all(math.isfinite(float(r["value"])) for r in rows)


def test_pictures_are_photographs_inside_the_page(found):
    noise = np.random.default_rng(0).integers(0, 255, (64, 64, 3), np.uint8)
    drawn = io.BytesIO()
    Image.fromarray(noise).save(drawn, "PNG")
    html = page(found, [drawn.getvalue()] * 2).decode()
    assert html.count('src="data:image/jpeg;base64,') == 2
    assert "image/png" not in html


def test_what_does_not_fit_is_refused():
    with pytest.raises(Problem, match=r"two metrics\.json are of run a/main"):
        tables([run("a", "main", 1.0)] * 2, [scene("a", "main", 0, 1.0)], {})
    with pytest.raises(Problem, match=r"two metrics\.json are of scene a/main/0"):
        tables([run("a", "main", 1.0)], [scene("a", "main", 0, 1.0)] * 2, {})
    with pytest.raises(Problem, match="are of no scene alone"):
        tables([run("a", "main", 1.0)], [run("a", "main", 1.0)], {})
    with pytest.raises(Problem, match="no runs"):
        tables([], [], {})


def test_a_recording_has_the_same_digest_wherever_it_lies(tmp_path):
    for place in ("here", "there"):
        (tmp_path / place / "images").mkdir(parents=True)
        (tmp_path / place / "images" / "0.png").write_bytes(b"1")
    assert digest_of(tmp_path / "here") == digest_of(tmp_path / "there")
    (tmp_path / "there" / "images" / "0.png").rename(tmp_path / "there" / "images" / "1.png")
    assert digest_of(tmp_path / "here") != digest_of(tmp_path / "there")
    assert digest_of(tmp_path / "here" / "images" / "0.png") == digest_of(tmp_path / "there" / "images" / "1.png")
