"""What points do by the tangent: few states of the body, each with courses in time; columns only where asked for."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Answers:
    """Columns sum_q courses[c, q, t] sum_s share[t, s] states[q, s]."""

    states: np.ndarray
    """Displacement of the points by one unit of each cause at each state of the tangent [m], (Q, S, K, 3)."""
    share: np.ndarray
    """What every frame takes from the states, (T, S)."""
    courses: np.ndarray
    """How much of each cause a column has at every frame, (C, Q, T)."""

    def __len__(self) -> int:
        return len(self.courses)

    @property
    def fields(self) -> np.ndarray:
        """Of every cause with a course of 1 [m], (T, Q, K, 3)."""
        return np.einsum("ts,qski->tqki", self.share, self.states, optimize=True)

    @property
    def columns(self) -> np.ndarray:
        """[m], (C, K, T, 3)."""
        return np.einsum("cqt,tqki->ckti", self.courses, self.fields, optimize=True)


def each(states: np.ndarray, share: np.ndarray, courses: np.ndarray) -> Answers:
    """Every cause, (Q, S, K, 3), with every course, (B, T): columns cause by cause, (Q B)."""
    return Answers(states, share, np.kron(np.eye(len(states))[:, :, None], courses[:, None]))


def side_by_side(parts: Sequence[Answers]) -> Answers:
    """Columns of all parts of one tangent, one part after the other."""
    causes = [len(part.states) for part in parts]
    courses = np.zeros((sum(map(len, parts)), sum(causes), len(parts[0].share)))
    row = at = 0
    for part, count in zip(parts, causes, strict=True):
        courses[row : row + len(part), at : at + count] = part.courses
        row, at = row + len(part), at + count
    return Answers(np.concatenate([part.states for part in parts]), parts[0].share, courses)
