"""How what has no name behaves, in the words of the page."""

from typing import Any

from surgisim.report.digits import shown

AT_REST = {True: "also at rest", False: "only under load", None: "only seen while tissue was held"}
CHANGE = {
    "holds": "holds once it is there", "grows": "grows while nothing else changes", "fades": "fades or ends again",
    None: "comes again and again",
}  # fmt: skip
ENERGY = {
    "gives": "gives it energy", "takes": "takes energy from it", "neither": "gives back what it takes",
}  # fmt: skip


def character(said: dict[str, Any]) -> list[tuple[str, str]]:
    """Question and answer; said: fields of artifacts/character.py's Character."""
    period = said["period"]
    return [
        ("acts", AT_REST[said["at_rest"]]),
        ("in time", CHANGE[said["change"]]),
        ("on the tissue", ENERGY[said["energy"]]),
        ("where", "in one place" if said["local"] else "everywhere, or in a layer"),
        ("periodic", f"every {shown(period)} s" if period else "no"),
    ]
