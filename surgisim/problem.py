"""Bad input, said in one sentence."""

import difflib
from collections.abc import Collection


class Problem(ValueError):
    """Something the user can mend: where, what was wanted, what was found, what to do.

    The command line and every stage print it as one line and exit with code 2; a
    traceback is shown only under `--debug`.
    """


def nearest(word: str, known: Collection[str]) -> str:
    """What of `known` a mistyped or shortened word most likely means."""
    begins = [name for name in known if name.startswith(word)] or [name for name in known if word and word in name]
    return begins[0] if begins else difflib.get_close_matches(word, known, 1, 0.0)[0]
