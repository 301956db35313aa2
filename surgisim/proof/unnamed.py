"""Whether what was modelled without a name behaves as what was concealed, and what it cuts of the held-out error."""

from surgisim.artifacts.character import Truly
from surgisim.artifacts.verdict import Verdict


def unnamed(kind: str, truth: Truly | None, verdict: Verdict, oracle: dict | None) -> dict | None:
    """Of a case whose effect is outside the catalogue and which has a law without a name; None otherwise.

    truth: how what is concealed behaves; oracle: what `held_out` says of the case. asked: question -> whether its
    answer is right; character: whether all are; modelled: whether physics.json has it; share: what it cuts of what the
    oracle would, and rises: whether the error with it is larger than without, where it is modelled, as nothing is cut
    else.
    """
    found = verdict.residual
    if kind != "outside" or found is None or not found.laws:
        return None
    asked = truth.right(found.character) if truth else {}
    before, after = found.held_out.get("before"), found.held_out.get("after")
    told = {
        "terms": [law.term for law in found.laws],
        "numbers": found.numbers,
        "said": found.character,
        "asked": asked,
        "answered": sum(asked.values()) / len(asked) if asked else None,
        "character": all(asked.values()) if asked else None,
        "modelled": found.helps,
        "before": before,
        "after": after,
        "share": None,
        "rises": None,
    }
    if before is None or after is None or oracle is None:
        return told
    cut, most = before - after if found.helps else 0.0, before - oracle["oracle"]
    return told | {"share": cut / most if oracle["shows"] and most > 0 else None, "rises": cut < 0}
