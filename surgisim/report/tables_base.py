"""A table of a page."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Cell:
    text: str
    protocol: str = ""
    interval: str = ""
    mark: str = ""
    """good, poor or few where it has a goal."""


@dataclass(frozen=True)
class Table:
    title: str
    head: list[str]
    rows: list[tuple[str, list[Cell]]]
    note: str = ""
