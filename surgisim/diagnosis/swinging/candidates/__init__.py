"""Laws that a swinging body is tried with, one module each holding `laws(frame)`: the folder is the catalogue.

A module that says DAMPS is of what takes energy out, of which a body that is only seen at rest says nothing; one that
says BASE is a part of the base, and tried where the base goes without it.
"""

import importlib
import pkgutil

from surgisim.diagnosis.swinging.law import Frame, Law


def laws(frame: Frame, elastic: bool, settles: bool) -> list[Law]:
    """All that are tried.

    elastic: whether the base has no viscosity, which is then one of them; settles: whether only where the body came to
    rest is seen.
    """
    modules = [importlib.import_module(m.name) for m in pkgutil.iter_modules(__path__, f"{__name__}.")]
    fits = [m for m in modules if (elastic or not getattr(m, "BASE", False)) and not (settles and hasattr(m, "DAMPS"))]
    return [law for module in fits for law in module.laws(frame)]
