"""What points do under a small stress that a law adds, wherever it acts: many places in one product."""

from collections.abc import Callable, Sequence

import numpy as np

from surgisim.diagnosis.form import Block
from surgisim.diagnosis.hypothesis import Hypothesis
from surgisim.diagnosis.look import Look
from surgisim.diagnosis.scopes import Where


def gradients(look: Look) -> np.ndarray:
    """F of every particle at the tangent's states, (S, P, 3, 3)."""
    near = look.base.tangent
    return look.once("gradients", None, lambda: np.stack([near.gradient(f) for f in near.frames]))


def weights(look: Look, wheres: Sequence[Where]) -> np.ndarray:
    """Share of the law at every particle, (Q, P)."""
    return np.stack([w.weight(look.rest) for w in wheres])


def at_states(look: Look, stresses: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Displacement of the points at the tangent's states [m], (Q, S, K, 3).

    stresses: first Piola stress of the whole law at each state [Pa], (S, P, 3, 3); shares: of it, (Q, P).
    """
    near = look.base.tangent
    loads = np.stack([near.of_stress(shares[:, :, None, None] * P) for P in stresses])
    return near.at_states(loads).swapaxes(0, 1)


def followed(look: Look, stress: Callable[[np.ndarray], np.ndarray], wheres: Sequence[Where]) -> np.ndarray:
    """Displacement of the points [m], (Q, K, T, 3), by a law that neither remembers nor looks at the clock.

    stress: from F, (P, 3, 3), to first Piola stress [Pa], (P, 3, 3); what it is at rest is taken off.
    """
    still = stress(np.broadcast_to(np.eye(3), (len(look.rest), 3, 3)).copy())
    states = at_states(look, np.stack([stress(F) - still for F in gradients(look)]), weights(look, wheres))
    return np.einsum("ts,qski->qkti", look.base.tangent.share, states, optimize=True)


def block(term: str, columns: Sequence[np.ndarray], wheres: Sequence[Where], sign: int, about: Sequence[dict]) -> Block:
    """A hypothesis a column: for each form (Q, K, T, 3), where it acts, and the other numbers of the form."""
    eye = np.eye(len(columns) * len(wheres))
    named = [(w, a) for a in about for w in wheres]
    return Block(
        np.concatenate(columns),
        [Hypothesis(term, eye[:, n : n + 1], sign, w.place, about=a, scope=w.scope) for n, (w, a) in enumerate(named)],
    )
