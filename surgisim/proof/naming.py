"""Whether what was concealed was called by its name.

The phantom and the engine are written apart and do not call everything the same: SAME says which of the engine's laws
are which of the phantom's effects. Nothing else is taken for the same.
"""

from surgisim.artifacts.verdict import Verdict

SAME = {"newtonian": "damping", "paper_viscous": "damping", "relaxation_slow": "relaxation"}
NOT_NAMED = ("nothing detectable", "unexplained")
SURE = 0.5
"""An effect outside the catalogue may be called by a catalogued name with less than this probability."""


def common(term: str) -> str:
    """A law's name in the phantom's words."""
    return SAME.get(term, term)


def said(verdict: Verdict) -> dict[str, float]:
    """Probability that was given to each name, by the verdict's effects and their runners-up, else the ranking."""
    found: dict[str, float] = {}
    for entry in verdict.ranking:
        # Places exclude each other, so that a name has the sum of its places.
        found[common(entry.term)] = found.get(common(entry.term), 0.0) + entry.probability
    if max(found.values(), default=0.0) > 1 + 1e-6:
        # Probabilities of the places themselves, not shared out among them.
        found = {t: max(e.probability for e in verdict.ranking if common(e.term) == t) for t in found}
    for effect in verdict.effects:
        found |= {common(term): p for term, p in effect.runners_up}
    return found | {common(e.term): e.probability for e in verdict.effects}


def order(verdict: Verdict) -> list[str]:
    """Names that it would give, the first being its best; those that it does name come first."""
    named = list(dict.fromkeys(common(term) for term in verdict.names))
    rest = said(verdict)
    return named + sorted((t for t in rest if t not in named), key=lambda t: -rest[t])


def naming(kind: str, names: tuple[str, ...], verdict: Verdict) -> dict:
    """What was named, against what was concealed; None where a question does not arise.

    top1, top2: the concealed law was named first, or first or second (a case with two: one of them was). A verdict
    that names nothing is never right, whatever its ranking. both: the first two names are the two concealed ones.
    false_discovery: something was named where nothing is. held_back: what no catalogue has was called unexplained,
    or named with a probability below SURE. wrong_names: for each name of a verdict whether it is wrong; an equivalence
    class is one name, wrong where it does not hold the truth. class_holds: such a class does.
    """
    known, given = order(verdict), [common(t) for t in verdict.names]
    speaks = bool(given)
    wanted, inside = {common(n) for n in names}, kind in ("one", "two")
    first = said(verdict).get(given[0], 0.0) if speaks else None
    return {
        "verdict": verdict.verdict,
        "named": [{"term": e.term, "probability": e.probability} for e in verdict.effects] if speaks else [],
        "stated": said(verdict),
        "ranked": known,
        "wrong_names": _wrong(verdict, wanted),
        "class_holds": bool(wanted & set(given)) if verdict.verdict == "equivalence class" and inside else None,
        "probability": first,
        "probability_of_truth": max((said(verdict).get(n, 0.0) for n in wanted), default=None),
        "abstained": not speaks,
        "top1": speaks and known[0] in wanted if inside else None,
        "top2": speaks and bool(wanted & set(known[:2])) if inside else None,
        "ranked_first": bool(known) and known[0] in wanted if inside else None,
        "both": speaks and wanted == set(given[:2]) if kind == "two" else None,
        "false_discovery": speaks if kind == "nothing" else None,
        "held_back": verdict.verdict == "unexplained" or (speaks and first < SURE) if kind == "outside" else None,
    }


def _wrong(verdict: Verdict, wanted: set[str]) -> list[bool]:
    given = [common(t) for t in verdict.names]
    if verdict.verdict == "equivalence class":
        return [not wanted & set(given)]
    return [name not in wanted for name in given]
