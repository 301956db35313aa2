"""Which clip and variant is meant, and what is said where that is not clear."""

import shutil

import pytest
from typer.testing import CliRunner

from surgisim.cli import app
from surgisim.problem import Problem
from surgisim.viewer.case import chosen, read
from surgisim.viewer.words import parameters


def test_the_one_that_is_there_is_meant_and_main_where_there_are_several(case, out, tmp_path):
    assert chosen(out, None, None) == ("slab", "main")
    for variant in ("main", "elastic_default"):
        shutil.copytree(out / "results" / "slab" / "main", tmp_path / "results" / "slab" / variant)
    assert chosen(tmp_path, None, None) == ("slab", "main")
    assert chosen(tmp_path, "slab", "elastic_default") == ("slab", "elastic_default")
    with pytest.raises(Problem, match="fits 0 of what was simulated"):
        chosen(tmp_path, "liver", None)


def test_a_variant_reads_what_it_shares_with_main(case, out, tmp_path):
    shutil.copytree(out / "results", tmp_path / "results")
    home = tmp_path / "results" / "slab"
    shutil.copytree(home / "main" / "simulation", home / "stiff" / "simulation")
    assert len(read(tmp_path, "slab", "stiff").body.rest) == len(case.body.rest)


def test_an_empty_folder_is_named_with_what_to_do(tmp_path):
    answer = CliRunner().invoke(app, ["view", str(tmp_path)])
    assert answer.exit_code != 0
    assert "nothing to view" in answer.output


def test_a_page_for_the_network_is_refused_before_anything_is_read(tmp_path):
    answer = CliRunner().invoke(app, ["view", str(tmp_path), "--host", "0.0.0.0"])
    assert answer.exit_code != 0
    assert "no token is set" in answer.output


def test_the_parameters_come_with_their_intervals(case):
    assert "| corotated | E | 2000 Pa | 1.8e+03 to 2.2e+03 |" in parameters(case)


def test_a_device_that_is_not_there_is_said(case, out):
    answer = CliRunner().invoke(app, ["view", str(out), "--device", "gpu"])
    assert answer.exit_code != 0
    assert "cpu or cuda is wanted" in answer.output
