"""What each case of a seed conceals: nothing, one effect, two, or one that no catalogue has."""

from typing import Literal

import numpy as np

from surgisim.phantom.effect import catalogue

Kind = Literal["nothing", "one", "two", "outside"]
DECK: tuple[Kind, ...] = ("nothing",) * 4 + ("two",) * 3 + ("outside",) * 3 + ("one",) * 10
"""Twenty cases in a row hold these, shuffled: 20 % nothing, 15 % two, 15 % outside."""


def concealed(seed: int, case: int, only: tuple[str, ...] = (), faint: bool = False) -> tuple[str, ...]:
    """Names of a case's effects. `only` restricts the catalogue; `faint` lets in what can hardly be seen."""
    effects = {n: e for n, e in catalogue().items() if (faint or not e.faint) and (not only or n in only)}
    inside = [n for n, e in effects.items() if not e.outside]
    outside = [n for n, e in effects.items() if e.outside]
    block, place = divmod(case, len(DECK))
    order = _rng(seed, block, 0).permutation(len(DECK))
    kind = DECK[order[place]]
    # How many cases of the same kind came before decides the card, so that every effect has its turn.
    before = block * DECK.count(kind) + sum(DECK[order[p]] == kind for p in range(place))
    if kind == "nothing":
        return ()
    names = outside if kind == "outside" else inside
    if not names:
        return ()
    first = names[_shuffled(seed, 1 if kind == "outside" else 2, len(names), before)]
    if kind != "two" or len(names) == 1:
        return (first,)
    rng = _rng(seed, case, 5)
    pair = names[_shuffled(seed, 3, len(names), before)]
    return pair, str(rng.choice([n for n in names if n != pair]))


def _shuffled(seed: int, what: int, count: int, number: int) -> int:
    """The card `number` of packs shuffled one after another."""
    return int(_rng(seed, number // count, what).permutation(count)[number % count])


def _rng(seed: int, number: int, what: int) -> np.random.Generator:
    return np.random.default_rng([seed, number, what, *b"mixture"])
