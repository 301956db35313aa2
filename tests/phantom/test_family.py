"""A family of clips: the same seed the same clips, different ones all over the ranges, each one that can be made."""

import numpy as np

from surgisim.config.phantom import Phantom
from surgisim.phantom.case import invent
from surgisim.phantom.family import FRAMES, family


def test_more_clips_leave_the_first_as_they_are():
    few, many = family(5, 3), family(5, 6)
    assert list(few) == list(many)[:3]
    assert all(few[name] == many[name] for name in few)
    assert family(6, 1) != {"family-6-0": few["family-5-0"]}


def test_clips_differ_in_what_a_stage_could_be_tuned_to():
    clips = [c["phantom"] for c in family(11, 30).values()]
    for name, least in {"E": 5.0, "thickness": 1.8, "distance": 1.6, "lift": 4.0, "fps": 2.0}.items():
        values = np.array([c[name] for c in clips])
        assert values.max() / max(values.min(), 1e-9) > least, name
    assert {c["sides"] for c in clips} == {"free", "held"}
    assert 0 < sum(c["release"] == c["duration"] for c in clips) < 15
    assert 3 < sum(c["dome"] > 0 for c in clips) < 20
    assert 2 < sum(c["smoke"] > 0 for c in clips) < 16
    told = [c["ingest"]["focal"] for c in family(11, 30).values()]
    assert 5 < sum(f is None for f in told) < 25


def test_every_clip_can_be_made():
    for clip in family(3, 12).values():
        settings = Phantom(**clip["phantom"])
        invent(settings)
        assert settings.duration * settings.fps <= FRAMES + 1
