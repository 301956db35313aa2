"""What a run should reach, and whether its interval lies there: good, poor, or too few to say."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

Mark = Literal["good", "poor", "few", "plain"]


@dataclass(frozen=True)
class Goal:
    at: float
    better: Literal["lower", "higher"]
    words: str


MASK = Goal(0.85, "higher", "at least 0.85")
TRACKS = Goal(1.0, "lower", "at most 1 px")
DEPTH = Goal(35.0, "lower", "at most 35 %")
DEPTH_MEASURED = Goal(15.0, "lower", "at most 15 % with a right view or given depth")
GRIP = Goal(20.0, "lower", "at most 20 %")
GAIN = Goal(0.0, "higher", "more than frame 0 held still")
STILL = Goal(60.0, "lower", "at most 60 % of a still body's")
STILL_TRUE = Goal(30.0, "lower", "at most 30 % of a still body's")
RIGID = Goal(100.0, "lower", "less than a rigid one's")
DEFAULT = Goal(100.0, "lower", "less than with default parameters")
INSIDE = Goal(0.8, "higher", "at least 0.8")


def mark(entry: dict[str, Any], goal: Goal) -> Mark:
    """Good where the whole 90 % interval is on the good side, poor where all of it is on the bad one; else too few."""
    low, high = entry.get("low"), entry.get("high")
    if low is None or high is None:
        return "few"
    if goal.better == "higher":
        return "good" if low >= goal.at else "poor" if high < goal.at else "few"
    return "good" if high <= goal.at else "poor" if low > goal.at else "few"


def worst(marks: Iterable[Mark]) -> Mark:
    """Poor if one is, else too few if one is; good only if all are."""
    found = set(marks)
    return next((m for m in ("poor", "few", "good") if m in found), "plain")
