"""One diagnosis as one HTML file."""

from surgisim.report.diagnosed import goodness, places, times
from surgisim.report.diagnosed.case import Diagnosed
from surgisim.report.diagnosed.character import character
from surgisim.report.diagnosed.laws import law
from surgisim.report.digits import shown
from surgisim.report.headline import Card
from surgisim.report.made import Made
from surgisim.report.page import template

BADGE = {
    "named": "named",
    "equivalence class": "one of several that this clip cannot tell apart",
    "nothing detectable": "nothing detectable",
    "unexplained": "unexplained",
}


def page(case: Diagnosed, made: Made | None = None, *, progress=lambda *_: None) -> bytes:
    """UTF-8, with every picture inside."""
    progress(0, 3, "places")
    pictures = {
        "mismatch": places.mismatch(case),
        "symptom": places.symptom(case),
        "cause": places.cause(case),
        "experiment": places.experiment(case),
    }
    progress(1, 3, "times")
    pictures |= {
        "times": times.mismatch(case),
        "both": times.symptom_and_cause(case),
        "bars": times.bars(case),
        "candidates": times.candidates(case),
        "goodness": goodness.per_frame(case),
    }
    content = {"case": case, "pictures": pictures, "cards": cards(case), "badge": BADGE[case.verdict.verdict]}
    content |= {"laws": [law(e, str(n)) for n, e in enumerate(case.verdict.effects, 1)], "title": title(case)}
    content |= without_a_name(case)
    text = template("diagnosis.html.j2").render(**content, made=made, shown=shown)
    progress(3, 3, "written")
    return text.encode()


def without_a_name(case: Diagnosed) -> dict[str, list]:
    """Laws without a name, and their character as rows of a table."""
    found = case.verdict.residual
    if found is None or not found.laws:
        return {"unnamed": [], "character": []}
    return {"unnamed": [law(e) for e in found.laws], "character": character(found.character)}


def title(case: Diagnosed) -> str:
    names = [n.replace("_", " ") for n in case.verdict.names]
    if not names:
        return {"nothing detectable": "nothing found", "unexplained": "something that no law here explains"}[
            case.verdict.verdict
        ]
    return (" or " if case.verdict.verdict == "equivalence class" else " and ").join(names)


def cards(case: Diagnosed) -> list[Card]:
    """The few numbers to know first."""
    verdict, rows = case.verdict, []
    if verdict.names:
        first = verdict.effects[0]
        others = ", ".join(f"{t.replace('_', ' ')} {100 * p:.0f} %" for t, p in first.runners_up[:2])
        beside = f"next: {others}" if others else "no other law comes near"
        rows.append(
            Card("Probability of the name", f"{100 * first.probability:.0f}", "%", beside, "", _mark(first.probability))
        )
    errors, which = (verdict.held_out, "held-out") if "after" in verdict.held_out else (verdict.fit, "fitted")
    if {"before", "after"} <= errors.keys() and verdict.names:
        gone = 1 - errors["after"] / errors["before"] if errors["before"] else 0.0
        floor = f", noise floor {shown(errors['noise_floor'])} mm" if "noise_floor" in errors else ""
        beside = f"from {shown(errors['before'])} to {shown(errors['after'])} mm{floor}"
        rows.append(
            Card(
                f"Error on {which} frames, cut by", f"{100 * gone:.0f}", "%", beside, "", "good" if gone > 0 else "poor"
            )
        )
    if verdict.detectable_above is not None:
        beside = "RMS over the tracked points: what is weaker is not seen in this clip"
        rows.append(Card("Detectable above", shown(verdict.detectable_above), "mm", beside, "", "plain"))
    if verdict.unexplained is not None and verdict.verdict != "nothing detectable":
        nearest = "by nothing that is named" if verdict.names else "even by the law that comes nearest"
        beside = f"of the whitened misfit, {nearest}"
        rows.append(Card("Left unexplained", f"{100 * verdict.unexplained:.0f}", "%", beside, "", "plain"))
    return rows


def _mark(probability: float) -> str:
    return "good" if probability >= 0.8 else "plain" if probability >= 0.5 else "poor"
