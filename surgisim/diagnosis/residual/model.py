"""What is left where nothing is named, as a law without a name: fitted, run again, shown on the frames held out."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

from surgisim.diagnosis import candidates
from surgisim.diagnosis.context import Case
from surgisim.diagnosis.errors import errors
from surgisim.diagnosis.joint import Joint
from surgisim.diagnosis.laws import IMPOSSIBLE, described
from surgisim.diagnosis.refit import Refit
from surgisim.diagnosis.replay import Replay, replayed
from surgisim.diagnosis.residual import words
from surgisim.diagnosis.residual.character import character
from surgisim.diagnosis.residual.fit import fit
from surgisim.diagnosis.said import place_of, time_of


@dataclass(frozen=True)
class Modelled:
    told: dict[str, Any]
    """As diagnosis.json has it."""
    words: str
    helps: bool = False
    """Whether the frames held out come nearer by more than their interval."""
    refits: tuple[Refit, ...] = ()
    """Its laws, with the numbers that they have beside one another."""
    shown: Replay | None = None
    """The predictions without and with it."""


def modelled(case: Case, say: Callable[[str], None]) -> Modelled:
    """Of a case whose verdict is that no law explains what is there."""
    found = fit(case, say)
    if found is None:
        return Modelled({"laws": [], "helps": False, "words": words.NOTHING_PAYS}, words.NOTHING_PAYS)
    say("a law without a name, on a finer grid")
    shown = replayed(case, found, None) or Replay(case.clip, case.base.simulated, found.moved, None)
    try:
        how = character(case, found)
    except IMPOSSIBLE:
        return Modelled({"laws": [], "helps": False, "words": words.NOTHING_PAYS}, words.NOTHING_PAYS)
    fitted, held_out = errors(replace(case, clip=shown.clip), shown.before, shown.after, None, case.noise)
    # Without frames held out nothing shows that it predicts.
    helps = held_out["gain_low"] is not None and held_out["gain_low"] > 0
    first = found.refits[0].finding.hypothesis
    said = words.sentence(first, how, numbers(found), held_out, helps)
    told = {
        "laws": [_told(case, r) for r in found.refits],
        "character": asdict(how),
        "numbers": numbers(found),
        "log_evidence": float(found.refits[0].log_evidence),
        "gain": float(found.gain),
        "fit": fitted,
        "held_out": held_out,
        "spacing": {"value": float(1e3 * shown.clip.body.spacing), "unit": "mm"},
        "helps": helps,
        "words": said,
    }
    return Modelled(told, said, helps, tuple(found.refits), shown)


def numbers(found: Joint) -> int:
    """How many were free."""
    starts = [(r.finding.hypothesis, r.amplitude) for r in found.refits]
    return sum(len(candidates.of(h).knobs(h, amplitude)) for h, amplitude in starts)


def _told(case: Case, r: Refit) -> dict[str, Any]:
    h = r.finding.hypothesis
    every = described(h, r.amplitude, r.finding.spread, case.clip, case.base, r.draws)
    # What its form leaves out (an end that never comes, a period of what is not periodic) is only in physics.json.
    free = {name: entry for name, entry in every.items() if entry["low"] < entry["high"]}
    return {
        "term": r.term,
        "place": place_of(h),
        "scope": h.scope,
        "time": time_of(h),
        "parameters": free,
        "size": {"value": float(1e3 * r.finding.size), "unit": "mm"},
    }
