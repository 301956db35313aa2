"""One case, scored: what was said against what was concealed."""

from typing import Any

import numpy as np

from surgisim.artifacts.character import Truly
from surgisim.artifacts.mismatch import Mismatch
from surgisim.artifacts.verdict import Effect, Verdict
from surgisim.phantom.effect import catalogue
from surgisim.phantom.families.hidden import KINDS
from surgisim.problem import Problem
from surgisim.proof.held_out import held_out
from surgisim.proof.naming import common, naming
from surgisim.proof.numbers import parameters
from surgisim.proof.places import onset, place
from surgisim.proof.truth import Truth
from surgisim.proof.unnamed import unnamed
from surgisim.recordings.recording import Recording

FORMAT = "surgisim-score/1"


def score(
    truth: Truth, recording: Recording, verdict: Verdict, mismatch: Mismatch | None = None, cell: float | None = None
) -> dict[str, Any]:
    """Every question of the proof, answered for one case; `cell` is the grid that the diagnosis used [m].

    Raises Problem where truth, recording and diagnosis are not of one case.
    """
    told = truth.told
    if not told["recording"] == verdict.recording == recording.name:
        raise Problem(
            f"the truth is of {told['recording']}, the recording is {recording.name} and the diagnosis is of "
            f"{verdict.recording}. Score files of one case."
        )
    errors = held_out(truth, recording, verdict, mismatch)
    return {
        "format": FORMAT,
        "recording": recording.name,
        "seed": told["seed"],
        "case": told["case"],
        "kind": told["kind"],
        "concealed": [_concealed(e) for e in truth.effects],
        "snr": told["snr"],
        "snr_held_out": told["snr_held_out"],
        "log_evidence": told.get("log_evidence"),
        "family": told.get("family", "blocks"),
        "snr_set": told.get("snr_set", told["snr"]),
        "scale": told.get("scale", 1.0),
        "noise": told["noise"],
        "phases": phases(recording),
        **naming(told["kind"], truth.names, verdict),
        "places": [p for e, named in _pairs(truth, verdict) if (p := place(e, named, cell))],
        "onsets": [o for e, named in _pairs(truth, verdict) if (o := onset(e, named, recording.fps))],
        "parameters": [row for e, named in _pairs(truth, verdict) for row in parameters(e, named, told["base"])],
        "evidence": verdict.evidence,
        "held_out": errors,
        "unnamed": unnamed(told["kind"], _character(told), verdict, errors),
        "detectable_above": verdict.detectable_above,
        "missing_phases": list(verdict.missing_phases),
        "words": verdict.words,
    }


def _character(told: dict[str, Any]) -> Truly | None:
    """How what is concealed behaves; None of what has a name."""
    if told["kind"] != "outside":
        return None
    name, blocks = told["effects"][0]["term"], "family" not in told
    return catalogue()[name].character if blocks else KINDS[name].character


def phases(recording: Recording) -> list[str]:
    """What goes on in the frames that may be fitted: rest, load, hold, release, second grasp."""
    first, last = recording.split["fit"][0] if recording.split else 0, recording.fitted_until
    motion, found = recording.motion, []
    held = motion.active[:, first:last]
    if not held.size or not held[:, 0].any():
        found.append("rest")
    for grip in np.flatnonzero(held.any(1)):
        inside = np.flatnonzero(motion.active[grip, first:last]) + first
        speed = np.linalg.norm(np.diff(motion.position[grip, inside[0] : inside[-1] + 1], axis=0), axis=-1)
        moving = speed > 1e-3 * max(speed.max(initial=0.0), 1e-12)
        found += ["load"] if moving.any() else []
        found += ["hold"] if (~moving).sum() > 2 else []
        found += ["release"] if inside[-1] + 2 < last else []
    if held.any(1).sum() > 1:
        found.append("second grasp")
    return list(dict.fromkeys(found))


def _pairs(truth: Truth, verdict: Verdict) -> list[tuple[dict[str, Any], Effect]]:
    """Concealed effects with what names them rightly."""
    named = verdict.effects if verdict.names else ()
    return [(e, n) for e in truth.effects for n in named if common(n.term) == e["term"]]


def _concealed(effect: dict[str, Any]) -> dict[str, Any]:
    return {
        "term": effect["term"],
        "outside_catalogue": effect["outside_catalogue"],
        "local": isinstance(effect["place"], dict),
        "onset": effect["time"]["onset"],
        "snr": effect.get("snr_alone_coarse"),
    }
