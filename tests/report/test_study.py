"""The preference study: a page that names no method, and the tally of what it saves."""

import json
import subprocess
import sys

import numpy as np
import pytest
from browser import Browser, installed

from surgisim.config.study import PARTS
from surgisim.problem import Problem
from surgisim.proof.study import preferences, study, told
from surgisim.report.page import template
from surgisim.video import mp4

CLIPS = "gallbladder", "liver", "bowel"
VARIANTS = sorted({v for variants in PARTS.values() for v in variants})


def frames(shade):
    ramp = np.linspace(0, 120, 48).astype(np.uint8)
    return np.stack([np.broadcast_to(np.roll(ramp, 2 * t)[None, :, None] + shade, (32, 48, 3)) for t in range(10)])


@pytest.fixture(scope="module")
def made():
    films = {(c, v): mp4(frames(20 * k), 10.0) for c in CLIPS for k, v in enumerate(VARIANTS)}
    return study(films, {c: (frames(5), 10.0) for c in CLIPS}, 3)


def sheet(key, participant, group, choose, sets=None):
    """Answers of somebody who chooses so: choose(part, number of the set) -> variant."""
    answers = []
    for n, (name, one) in enumerate(list(key["sets"].items())[:sets]):
        wanted = choose(one["part"], n)
        chosen = next(f for f in one["films"] if key["films"][f]["variant"] == wanted)
        answers.append({"set": name, "chosen": chosen})
    base = {"format": "surgisim-study/1", "study": key["study"], "participant": participant, "group": group}
    return base | {"answers": answers}


def test_the_page_names_no_variant_and_no_clip_and_orders_films_by_nothing_that_tells(made):
    page, _ = made
    html = template("study.html.j2").render(told=page)
    assert not any(name in html for name in (*CLIPS, "elastic_default", "point_cloud", "no_estimation"))
    assert {one["part"]: len(one["films"]) for one in page["sets"]} == {p: len(v) for p, v in PARTS.items()}
    assert all(one["films"] == sorted(one["films"]) for one in page["sets"])
    films = {(c, v): b"" for c in CLIPS for v in VARIANTS}
    first = set()
    for seed in range(8):
        other, its_key = study(films, {c: (frames(0), 10.0) for c in CLIPS}, seed)
        first |= {its_key["films"][one["films"][0]]["variant"] for one in other["sets"] if one["part"] == "methods"}
    assert first == set(PARTS["methods"])


def test_a_film_that_is_missing_is_named(made):
    with pytest.raises(Problem, match="no film of liver/elastic_default, liver/point_cloud"):
        study({("liver", "main"): b"", ("liver", "no_estimation"): b""}, {"liver": (frames(0), 10.0)}, 0)


def test_shares_are_of_participants_with_intervals_and_what_is_left_out_is_counted(made):
    _, key = made
    keen = [sheet(key, f"s{n}", "surgeon", lambda part, k: "main") for n in range(3)]
    torn = [sheet(key, f"o{n}", "other", lambda part, k, n=n: "main" if n % 2 else PARTS[part][1]) for n in range(4)]
    half = sheet(key, "h", "other", lambda part, k: "main", sets=1)
    odd = sheet(key, "x", "other", lambda part, k: "main")
    odd["answers"][0]["chosen"] = "nothing"
    found = preferences(key, [*keen, *torn, half, odd, keen[0], keen[1] | {"study": "another"}])
    assert found["participants"] == 8
    assert found["left_out"] == {"of another study": 1, "a participant's second": 1, "not of these films": 1}
    methods = found["parts"]["methods"]
    assert methods["surgeon"]["participants"] == 3
    assert methods["surgeon"]["shares"]["main"] == {"mean": 100.0, "low": 100.0, "high": 100.0}
    assert methods["other"]["participants"] == 4
    assert methods["other"]["shares"]["main"]["mean"] == 50.0
    assert methods["other"]["shares"]["main"]["low"] < 25 < 75 < methods["other"]["shares"]["main"]["high"]
    assert methods["all"]["shares"]["main"]["mean"] == pytest.approx(100 * 5 / 7, abs=0.1)
    assert found["parts"]["parameters"]["all"]["chance"] == 50.0
    for part in PARTS:
        assert sum(s["mean"] for s in found["parts"][part]["all"]["shares"].values()) == pytest.approx(100, abs=0.3)


def test_intervals_cover_what_a_crowd_prefers(made):
    _, key = made
    rng, inside = np.random.default_rng(281137), 0
    for _ in range(60):
        sheets = [sheet(key, str(n), "other", lambda part, k: PARTS[part][int(rng.random() > 0.6)]) for n in range(20)]
        told = preferences(key, sheets, draws=400)["parts"]["methods"]["all"]["shares"]["main"]
        inside += told["low"] <= 60 <= told["high"]
    # 90 % intervals of twenty people: binomial with 60 trials, two standard deviations below 88 %.
    assert inside >= 48


def test_what_is_no_sheet_is_one_sentence():
    with pytest.raises(Problem, match="here: is not JSON"):
        told([("here", "{")])
    with pytest.raises(Problem, match="here: is no sheet of answers"):
        told([("here", "{}")])


def test_the_tally_is_a_command(made, tmp_path):
    _, key = made
    (tmp_path / "key.json").write_text(json.dumps(key))
    (tmp_path / "a.json").write_text(json.dumps(sheet(key, "a", "other", lambda part, k: "main")))
    command = [sys.executable, "-m", "surgisim.proof.preferences", str(tmp_path / "key.json")]
    done = subprocess.run([*command, str(tmp_path / "a.json")], capture_output=True, text=True)
    assert json.loads(done.stdout)["participants"] == 1
    wrong = subprocess.run([*command[:-1], str(tmp_path / "a.json"), "x"], capture_output=True, text=True)
    assert wrong.returncode == 2
    assert "is no key to a study" in wrong.stderr


STEP = """
const wait = (ok) => new Promise((done, fail) => { const from = performance.now(); (function look() {
  if (ok()) done();
  else if (performance.now() - from > 15000) fail('waited too long');
  else setTimeout(look, 30); })(); });
"""


@pytest.mark.slow
def test_somebody_goes_through_the_page_and_what_it_saves_is_tallied(made, tmp_path):
    if not installed():
        pytest.skip("NO BROWSER: chromium and chromedriver are not installed, so nobody took part.")
    page, key = made
    (tmp_path / "study.html").write_text(template("study.html.j2").render(told=page))
    orders = []
    with Browser() as browser:
        for seed in (5, 5, 6):
            browser.open((tmp_path / "study.html").as_uri() + f"?seed={seed}")
            text = browser.run(
                STEP + "localStorage.clear(); sheet = begun(); go(-1);"
                "document.querySelector('input[value=surgeon]').click();"
                "[...document.querySelectorAll('button')].find(b => b.textContent === 'Begin').click();"
                f"for (let n = 0; n < {len(page['sets'])}; n++) {{"
                "  const next = [...document.querySelectorAll('button')].find(b => /Next|Finish/.test(b.textContent));"
                "  if (!next.disabled) return 'could go on without a choice';"
                "  await wait(() => [...document.querySelectorAll('video')].every(v => v.readyState > 1 && !v.error));"
                "  document.querySelectorAll('.option input')[0].click();"
                "  if (next.disabled) return 'could not go on'; next.click(); }"
                "return document.querySelector('textarea').value"
            )
            saved = json.loads(text)
            orders.append([(one["set"], one["films"]) for one in saved["order"]])
        again = browser.run("location.reload(); return 1")
        browser.open((tmp_path / "study.html").as_uri())
        kept = browser.run("return document.querySelector('textarea') && document.querySelector('textarea').value")
        browser.resize(420, 800)
        browser.run("go(0); return 1")
        wide = browser.run("return [document.documentElement.scrollWidth, innerWidth]")
        complaints = browser.log()
    assert again == 1
    assert orders[0] == orders[1] != orders[2]
    parts = [key["sets"][name]["part"] for name, _ in orders[0]]
    assert parts == ["methods"] * len(CLIPS) + ["parameters"] * len(CLIPS)
    assert json.loads(kept)["answers"] == saved["answers"]
    found = preferences(key, told([("page", text)]))
    assert found["parts"]["methods"]["surgeon"]["participants"] == 1
    assert wide[0] <= wide[1]
    assert complaints == []
