"""What runs, what is shared, and what an edit starts again."""

import os
import re
import time
from pathlib import Path

import pytest
import yaml

from surgisim.config.whole import PARENTS

ROOT = Path(__file__).parents[2]
VARIANTS = list(yaml.safe_load((ROOT / "config" / "variants.yaml").read_text()))
STAGES = set(PARENTS) | {"summary"}


def below(*stages: str) -> set[str]:
    """The stages, and all that come after them."""
    reached = set(stages)
    for stage, parents in PARENTS.items():
        if reached & set(parents):
            reached.add(stage)
    return reached | {"summary"}


@pytest.mark.parametrize("variant", VARIANTS)
def test_every_variant_has_a_complete_graph(tree, variant):
    tree.choices = {"run": [variant]}
    assert tree.rules() == STAGES


def test_variants_share_what_they_do_not_change(tree):
    tree.choices = {"run": VARIANTS}
    made = {}
    for stage, *where in tree.plan():
        made.setdefault(stage, set()).add(where[-1] if where else "")
    assert made["masking"] == made["inpainting"] == {"main"}
    assert made["depth"] == made["tracking"] == {"main", "near_light"}
    assert made["reconstruction"] == {"main", "no_trajectory", "no_anisotropy", "no_both", "near_light"}
    # Masses and springs have the default numbers, as no_estimation has.
    assert made["estimation"] == set(VARIANTS) - {"no_relight", "point_cloud", "mesh"}
    assert made["simulation"] == set(VARIANTS)
    assert made["evaluation"] == made["report"] == set(VARIANTS)


def test_the_papers_tables_ask_for_their_runs_and_for_scenes_with_several_seeds(tree):
    jobs = tree.plan("tables")
    made = {}
    for stage, *where in jobs:
        made.setdefault(stage, set()).add(tuple(where))
    assert {variant for _, variant in made["evaluation"]} == {"main", "elastic_default", "point_cloud", "mesh"}
    assert {variant for _, variant in made["reconstruction"]} == {"main"}
    assert len(made["tables"]) == 1
    terms = {"main", "no_trajectory", "no_anisotropy", "no_both"}
    wanted = {(v, str(seed)) for v in terms for seed in range(3)} | {("near_light", "0")}
    for rule in ("scene_again", "scene_score"):
        assert {tuple(sorted(where)) for where in made[rule]} == {tuple(sorted(("demo", *w))) for w in wanted}


def test_a_film_has_no_depth_of_its_own_to_be_tried_beside_depth_by_light(tree):
    film = tree.root / "config" / "film.mp4"
    film.write_bytes(b"a film")
    (tree.root / "config" / "packed.zip").write_bytes(b"frames, and depth perhaps")
    rows = "film\tfilm.mp4\npacked\tpacked.zip\ndemo\tphantom\n"
    (tree.root / "config" / "clips.tsv").write_text("name\tpath\n" + rows)
    scenes = {tuple(sorted(where)) for rule, *where in tree.plan("tables") if rule == "scene_again"}
    assert {where for where in scenes if "near_light" in where} == {
        ("0", "demo", "near_light"),
        ("0", "near_light", "packed"),
    }


def test_a_hundred_clips_are_planned(tree):
    rows = "".join(f"clip{i}\tphantom\t{100 + i}\n" for i in range(100))
    (tree.root / "config" / "clips.tsv").write_text("name\tpath\tfocal\n" + rows)
    assert len(tree.plan()) == 100 * len(PARENTS) + 1


def test_nothing_runs_twice(finished):
    assert not finished.plan()


def test_touching_the_library_runs_nothing(finished):
    later = time.time() + 60
    for path in (finished.root / "surgisim").rglob("*.py"):
        os.utime(path, (later, later))
    assert not finished.plan()


@pytest.mark.parametrize(
    ("edited", "users"),
    [
        ("surgisim/perception/masking/colour_motion.py", {"masking"}),
        ("surgisim/config/depth.py", {"depth"}),
        ("surgisim/report/style.css", {"report"}),
        ("surgisim/physics/terms/newtonian.py", {"estimation", "simulation"}),
        ("surgisim/stage.py", STAGES),
        ("surgisim/doctor.py", None),
    ],
)
def test_an_edit_runs_exactly_the_stages_that_use_the_file(finished, edited, users):
    text = (finished.root / edited).read_text()
    finished.edit(edited, "\n/* */\n" if edited.endswith(".css") else "\n# edited\n")
    try:
        wanted = set() if users is None else below(*users)
        assert finished.rules() - {"summary"} == wanted - {"summary"}
    finally:
        (finished.root / edited).write_text(text)


def test_a_new_law_runs_what_scans_the_laws(finished):
    law = finished.root / "surgisim" / "physics" / "terms" / "invented.py"
    law.write_text('"""A law."""\n')
    try:
        started = finished.rules()
        assert {"estimation", "simulation"} <= started
        assert "reconstruction" not in started
    finally:
        law.unlink()


def test_a_setting_reaches_its_own_stage_and_what_follows(finished):
    finished.choices = {"reconstruction": {"iterations": 70}}
    try:
        assert finished.rules() == below("reconstruction")
    finally:
        finished.choices = {}


@pytest.mark.slow
def test_what_a_failed_stage_left_from_before_is_not_taken_for_new(tree):
    assert tree.run() == 0
    tree.edit("stages/depth.py")
    (tree.root / "broken").write_text("depth")
    assert tree.run() != 0
    assert tree.rules() == below("depth")
    (tree.root / "broken").unlink()
    assert tree.run() == 0
    assert not tree.plan()


def test_the_truth_reaches_what_measures_and_its_page_only():
    users = [
        line.split()[1].rstrip(":")
        for path in (ROOT / "workflow" / "rules").glob("*.smk")
        for block in path.read_text().split("\n\n\n")
        if "truth=truth" in block
        for line in block.splitlines()
        if line.startswith("rule ")
    ]
    assert sorted(users) == ["evaluation", "report", "scene_score"]


def test_a_stage_reads_only_from_stages_whose_settings_count_as_its_own():
    # Otherwise a variant could share an output although something it depends on differs.
    ancestors = {}
    for stage, parents in PARENTS.items():
        ancestors[stage] = set(parents).union(*(ancestors[p] for p in parents))
    for path in (ROOT / "workflow" / "rules").glob("*.smk"):
        for block in path.read_text().split("\nrule ")[1:]:
            stage = block.split(":")[0]
            read = {part.split('"')[1] for part in block.split("upstream(")[1:]}
            # What is no stage of the graph is made for each variant anew, and may read all of it.
            allowed = ancestors.get(stage, set(PARENTS))
            assert read <= allowed, (stage, read - allowed)


def test_a_mistake_in_the_config_is_one_sentence(tree):
    tree.choices = {"reconstruction": {"iteratons": 7}}
    assert "there is no key 'reconstruction.iteratons'; did you mean 'iterations'?" in tree.says("--dry-run")


CONCEALED = {
    "invent",
    "invent_clip",
    "seals",
    "shuffle",
    "shorten",
    "diagnosis",
    "diagnosis_report",
    "score",
    "scoreboard",
    "pooled",
}
CONCEALED |= {"study", "robustness", "metamorphic", "perturb", "draws", "draw", "self_consistency"}
CONCEALED |= {
    "interval_coverage",
    "clip_table",
    "clip_pictures",
    "diagnosis_picture",
    "gallery",
    "known",
    "known_direct",
    "known_score",
    "known_board",
    "ablations",
    "across",
    "recorded",
    "scene_score",
    "tables",
}
AGAIN = {
    "verification",
    "verification_case",
    "known_base",
    "known_diagnosis",
    "known_report",
    "clip_diagnosis",
    "clip_diagnosis_report",
    "perturbed_diagnosis",
    "drawn_diagnosis",
    "scene_again",
}
"""Rules that run the module of another's name."""
ASKED_FOR = {"blind", "blind_across", "blind_shuffled", "blind_ablations", "blind_phases", "blind_pooled", "blind_real"}
ASKED_FOR |= {"clip_diagnoses", "coverage", "real_clips", "pictures", "kept_pictures"}
TAKEN_OVER = {"body", "body_again"}
"""The rule `invent` with other files: bodies whose answers are known to whoever develops."""
"""Rules without a stage of their own: what `snakemake NAME` makes."""


def blocks() -> dict[str, str]:
    """Text of every rule, by name."""
    texts = [path.read_text() for path in (ROOT / "workflow" / "rules").glob("*.smk")]
    rules = [block for text in texts for block in re.split(r"\n(?:use )?rule ", text)[1:]]
    return {re.sub(r"\w+ as (\w+) with", r"\1", block.split(":")[0]): block for block in rules}


def test_every_stage_has_a_rule_and_every_rule_a_log_a_benchmark_and_a_digest():
    assert {path.stem for path in (ROOT / "stages").glob("*.py")} == STAGES | CONCEALED
    found = blocks()
    assert set(found) == STAGES | CONCEALED | ASKED_FOR | AGAIN | TAKEN_OVER
    for stage in set(found) - ASKED_FOR - TAKEN_OVER:
        for key in ("log:", "benchmark:", "conda:", "mem_mb=", "code="):
            assert key in found[stage], (stage, key)


def test_only_the_rule_that_scores_reads_what_is_sealed():
    parts = {name: block.partition("output:") for name, block in blocks().items()}
    assert {name for name, (before, _, _) in parts.items() if "/sealed/" in before} == {"score", "robustness"}
    assert {name for name, (_, _, after) in parts.items() if "/sealed/" in after} == {
        "invent",
        "invent_clip",
    } | TAKEN_OVER
