"""Headlines that are told phase by phase, each value with its interval and its own mark."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from surgisim.measure.spans import THREE
from surgisim.report.digits import short, shown, spread
from surgisim.report.goals import Goal, Mark, mark, worst
from surgisim.report.story import Story

Entries = Callable[[str], dict[str, Any] | None]
"""From a number's name, with {span} in it, to what it is in this phase."""


@dataclass(frozen=True)
class Line:
    """One phase of a headline."""

    phase: str
    value: str
    interval: str
    beside: str
    mark: Mark


@dataclass(frozen=True)
class Headline:
    """One number of every phase, and what it is held against."""

    group: str
    name: str
    """With {span} in it."""
    judged: tuple[tuple[str, Goal], ...]
    """Names, with {span}, of the numbers that must all reach their goals."""
    beside: Callable[[Entries], str]
    """Words beside the value."""


def lines(story: Story, headline: Headline) -> list[Line]:
    """A line a phase that was measured; without a grip there is none."""
    entries, found = story.metrics.values.get(headline.group, {}), []
    for span in THREE:
        entry = entries.get(headline.name.format(span=span))
        if entry is None:
            continue
        marks = [mark(e, goal) for n, goal in headline.judged if (e := entries.get(n.format(span=span)))]
        beside = headline.beside(lambda name, span=span: entries.get(name.format(span=span)))
        value = f"{shown(entry['value'])} {short(entry['unit'])}".strip()
        found.append(Line(span, value, spread(entry), beside, worst(marks)))
    return found
