"""Perturbed and drawn recordings in the graph: all that is asked for, and nothing that gives an answer away."""

from surgisim.proof.perturb.names import INVENTED, KEYED, KEYLESS, SETTINGS


def test_every_body_is_diagnosed_under_every_perturbation(tree):
    tree.choices = {"seed": 907001, "bodies": 3}
    plan = tree.plan("robustness")
    count = {rule: sum(job[0] == rule for job in plan) for rule in {job[0] for job in plan}}
    assert count["body"] == 3
    assert count["body_again"] == 3 * len(INVENTED)
    assert count["perturb"] == 3 * len(KEYED)
    assert count["perturbed_diagnosis"] == 3 * (1 + len(KEYED) + len(INVENTED))


def test_recordings_without_a_key_are_perturbed_where_they_lie(tree):
    places = [tree.out / name / "recording" for name in ("first", "second")]
    for place in places:
        place.mkdir(parents=True)
        for file in ("recording.json", "rest.ply", "fixed.json", "tracks.npz"):
            (place / file).write_text("made up")
    tree.choices = {"recordings": [str(place) for place in places]}
    plan = tree.plan("metamorphic")
    diagnosed = {job[1:] for job in plan if job[0] == "perturbed_diagnosis"}
    assert len(diagnosed) == 2 * (1 + len(KEYLESS) + len(SETTINGS))
    assert {home for home, _ in diagnosed} == {"metamorphic/first", "metamorphic/second"}
    assert not {job for job in plan if job[0] in ("known", "invent", "body")}


def test_as_many_recordings_are_drawn_as_asked_for(tree):
    tree.choices = {"seed": 907001, "draws": 5}
    plan = tree.plan("self_consistency")
    assert {sum(job[0] == rule for job in plan) for rule in ("draw", "drawn_diagnosis")} == {5}
    assert sum(job[0] == "draws" for job in plan) == 1
