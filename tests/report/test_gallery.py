"""The gallery: runs and opened cases on one page that stands alone and is small."""

import json
import re

import numpy as np
import pytest
from PIL import Image
from proof import made_up
from proof.made_up import diagnosis
from report.made_up import invent

from surgisim.artifacts.metrics import Metrics
from surgisim.problem import Problem
from surgisim.report.gallery import PICTURES, opened, page, run
from surgisim.report.made import made


def jpeg(tmp_path) -> bytes:
    path = tmp_path / "one.jpg"
    Image.fromarray(np.full((8, 8, 3), 90, np.uint8)).save(path)
    return path.read_bytes()


def one(folder, score: dict, **told):
    case = made_up.case(folder, extra=2e-3, told=diagnosis(**told))
    path = folder / "score.json"
    path.write_text(json.dumps({"recording": "r-made", **score}))
    names = ("recording", "diagnosis.json", "mismatch.npz", "physics.json")
    return opened(*(case / name for name in names), path)


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    folder = tmp_path_factory.mktemp("gallery")
    clip = invent((40, 48), 12, 0)
    metrics = Metrics(
        "clip_1", "main", {"simulation": {"psnr_between": {"value": 31.2, "unit": "dB", "protocol": "a"}}}, {}
    )
    first = run("clip_1", dict.fromkeys(PICTURES, jpeg(folder)), clip["physics"], clip["fit"], metrics)
    hidden = [{"term": "tether", "outside_catalogue": False}]
    right = one(folder / "right", {"verdict": "named", "concealed": hidden, "wrong_names": [False]})
    alarm = one(folder / "alarm", {"verdict": "named", "concealed": [], "wrong_names": [True]})
    silent = one(
        folder / "silent", {"verdict": "nothing detectable", "concealed": [], "wrong_names": []},
        verdict="nothing detectable", ranking=[],
    )  # fmt: skip
    return first, [right, alarm, silent]


def test_the_page_needs_nothing_beside_it_and_says_what_was_concealed(shown):
    first, cases = shown
    text = page([first], cases, made(), 8_000_000).decode()
    links = re.findall(r"""(?:src|href)="([^"]+)""", text)
    assert all(link.startswith(("data:", "#")) for link in links)
    assert all(f'id="{link[1:]}"' in text for link in links if link.startswith("#"))
    assert "31.2 dB" in text
    assert "Concealed: <b>tether</b>" in text
    assert "Concealed: <b>nothing</b>" in text


def test_what_was_said_is_marked_by_whether_it_is_so(shown):
    assert [case.right for case in shown[1]] == ["good", "poor", "good"]


def test_a_page_that_would_be_too_large_is_refused(shown):
    with pytest.raises(Problem, match=r"gallery: the page takes \d+ bytes, and at most 1000 are wanted"):
        page([shown[0]], shown[1], made(), 1000)


def test_a_score_of_another_case_is_refused(tmp_path):
    with pytest.raises(Problem, match=r"score\.json: is of r-other"):
        one(tmp_path, {"recording": "r-other", "verdict": "named", "concealed": [], "wrong_names": []})
