"""Forms of a residual law, one file each, in the shape of the named candidates: their name is that of their term.

They are tried only where nothing is named (`residual/fit.py`), so that no verdict can depend on them.
"""

import importlib
import pkgutil
from functools import cache

from surgisim.diagnosis.candidate import Candidate


@cache
def catalogue() -> dict[str, Candidate]:
    """Every form by name."""
    modules = pkgutil.iter_modules(__path__, f"{__name__}.")
    return {m.name.rpartition(".")[2]: importlib.import_module(m.name).CANDIDATE for m in modules}
