"""Clips, variants and settings: how they are merged, shared and refused."""

import json

import pytest

from surgisim.plan import merged, plan, table_of
from surgisim.problem import Problem


@pytest.fixture
def tables(tmp_path):
    def write(clips="name\tpath\ndemo\tphantom\n", variants="main: {}\n", config=None):
        (tmp_path / "clips.tsv").write_text(clips)
        (tmp_path / "variants.yaml").write_text(variants)
        return plan(config or {}, clips=tmp_path / "clips.tsv", variants=tmp_path / "variants.yaml")

    return write


def says(tables, **changes) -> str:
    with pytest.raises(Problem) as caught:
        tables(**changes)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_typo_names_the_key_and_the_nearest_one(tables):
    said = says(tables, config={"ingest": {"sise": 3}})
    assert "'ingest.sise'" in said
    assert "did you mean 'size'" in said


def test_a_table_is_a_path(tmp_path):
    usual = tmp_path / "clips.tsv"
    assert table_of({}, "clips", usual) == usual
    assert table_of({"clips": "mine.tsv"}, "clips", usual).name == "mine.tsv"
    with pytest.raises(
        Problem, match=r"key 'clips' is \['a.mp4'\], and the path of a file is wanted, such as clips.tsv"
    ):
        table_of({"clips": ["a.mp4"]}, "clips", usual)


def test_a_stage_that_does_not_exist_names_the_nearest_one(tables):
    assert "did you mean 'reconstruction'" in says(tables, config={"reconstuction": {}})


def test_a_variant_that_does_not_fit_is_named(tables):
    said = says(tables, variants="main: {}\nno_trajectory:\n  reconstruction:\n    trajektory: 0\n")
    assert "variant 'no_trajectory'" in said
    assert "did you mean 'trajectory'" in said


def test_a_variant_may_change_the_diagnosis_and_shares_everything_else(tables):
    todo = tables(variants="main: {}\nplain: {diagnosis: {offsets: false}}\n", config={"diagnosis": {"free": 1}})
    main, plain = (json.loads(todo.slices["diagnosis", "demo", variant]) for variant in ("main", "plain"))
    assert (main["free"], main["offsets"]) == (1, True)
    assert plain == main | {"offsets": False}
    assert todo.homes["simulation", "demo", "plain"] == "main"
    assert "did you mean 'offsets'" in says(tables, variants="main: {}\nplain: {diagnosis: {ofsets: false}}\n")


def test_a_variant_asked_for_that_does_not_exist_is_named(tables):
    assert "elastc" in says(tables, config={"run": ["elastc"]})


def test_the_main_variant_changes_nothing(tables):
    assert "'main' changes nothing" in says(tables, variants="main: {ingest: {size: 5}}\n")


def test_a_clip_with_a_wrong_column_is_named(tables):
    said = says(tables, clips="name\tpath\tingest.focl\nheart\tphantom\t300\n")
    assert "clip 'heart'" in said
    assert "did you mean 'focal'" in said


@pytest.mark.parametrize(
    ("table", "complaint"),
    [
        ("name\tpath\n", "0 rows"),
        ("clip\tfile\na\tb\n", "under 'name' and 'path'"),
        ("name\tpath\na\tx\na\ty\n", "two rows are named 'a'"),
        ("name\tpath\n../a\tx\n", "named '../a'"),
        ("name\tpath\na\tx\ty\n", "more or fewer cells"),
    ],
)
def test_a_table_that_cannot_be_read_is_refused(tables, table, complaint):
    assert complaint in says(tables, clips=table)


def test_a_clip_overrides_the_config_and_a_variant_the_clip(tables):
    todo = tables(
        clips="name\tpath\tfocal\tingest.size\none\tphantom\t300\t\ntwo\tphantom\t\t100\n",
        variants="main: {}\nsmall: {ingest: {size: 50}}\n",
        config={"ingest": {"size": 200}},
    )

    def ingest(clip, variant):
        settings = json.loads(todo.slices["ingest", clip, variant])
        return settings["focal"], settings["size"]

    assert ingest("one", "main") == (300.0, 200)
    assert ingest("two", "main") == (None, 100)
    assert ingest("two", "small") == (None, 50)


def test_a_table_names_files_from_its_own_folder(tables, tmp_path):
    todo = tables(clips="name\tpath\tmasking.encoder\na\tsub/clip.mp4\tweights/encoder.onnx\n")
    assert todo.clips["a"].path == tmp_path / "sub" / "clip.mp4"
    assert json.loads(todo.slices["masking", "a", "main"])["encoder"] == str(tmp_path / "weights" / "encoder.onnx")


def test_a_cell_may_name_a_file_with_the_value(tables, tmp_path):
    (tmp_path / "clicks.json").write_text('[{"frame": 0, "x": 3, "y": 4}]')
    todo = tables(clips="name\tpath\tclicks\na\tphantom\t@clicks.json\n")
    assert json.loads(todo.slices["masking", "a", "main"])["clicks"][0]["x"] == 3


def test_a_grip_is_given_by_its_middle_radius_and_times(tables):
    todo = tables(clips="name\tpath\tgrasp\na\tphantom\t31,20,6,0.5\n")
    grip = json.loads(todo.slices["tracking", "a", "main"])["grasp"][0]
    assert grip == {"pixel": [31.0, 20.0], "radius": 6.0, "start": 0.5, "end": None}
    assert "X,Y,RADIUS is wanted" in says(tables, clips="name\tpath\tgrasp\na\tphantom\t31,20\n")


def test_a_stage_sees_its_own_settings_only(tables):
    slices = tables().slices
    assert "iterations" in json.loads(slices["reconstruction", "demo", "main"])
    assert "size" not in json.loads(slices["reconstruction", "demo", "main"])


def test_a_variant_leaves_home_at_the_first_stage_it_touches(tables):
    homes = tables(variants="main: {}\nfew: {reconstruction: {iterations: 50}}\n").homes
    assert homes["depth", "demo", "few"] == homes["tracking", "demo", "few"] == "main"
    assert homes["reconstruction", "demo", "few"] == homes["estimation", "demo", "few"] == "few"


def test_two_variants_that_change_the_same_share_with_each_other(tables):
    homes = tables(variants="main: {}\na: {masking: {margin: 4}}\nb: {masking: {margin: 4}}\n").homes
    assert homes["simulation", "demo", "b"] == "a"
    assert homes["evaluation", "demo", "b"] == "b"


def test_merging_goes_into_groups_and_replaces_lists():
    assert merged({"a": {"b": 1, "c": [1, 2]}}, {"a": {"c": [3]}}) == {"a": {"b": 1, "c": [3]}}
