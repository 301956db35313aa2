"""How a body's recordings are diagnosed, decided by the case: by a tangent stiffness, or by the engine's own runs."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from surgisim.artifacts.diagnosis import Diagnosis
from surgisim.artifacts.mismatch import Mismatch
from surgisim.artifacts.physics import Physics
from surgisim.config.diagnosis import Diagnosing
from surgisim.diagnosis.clip import clip_of, spacing_of
from surgisim.diagnosis.diagnose import Progress, diagnose
from surgisim.diagnosis.memo import Memo
from surgisim.diagnosis.swinging.course import simulate, whole
from surgisim.diagnosis.swinging.diagnose import diagnose_swinging, same_body
from surgisim.diagnosis.swinging.period import responses
from surgisim.mpm.setup import values_of
from surgisim.mpm.simulator import Breakdown
from surgisim.physics.place import Place
from surgisim.problem import Problem
from surgisim.recordings.recording import Recording


def diagnose_body(
    seen: Sequence[Recording], held_out: Recording | None, settings: Diagnosing, progress: Progress, memo: Memo
) -> tuple[Diagnosis, Physics, Mismatch]:
    """Of one body, recorded once or several times; held_out: a recording that is never fitted.

    Which way is taken goes by its slowest period beside how fast it is loaded (`swinging/period.py`). Raises Problem
    where the recordings cannot be used.
    """
    clip = clip_of(seen[0], share=settings.grid, device=settings.device)
    if responses(clip, clip.prior.middle).by_engine:
        return diagnose_swinging(seen, held_out, settings, progress, memo)
    if len(seen) > 1:
        raise Problem(
            f"recording {seen[0].name}: several recordings at once are diagnosed of bodies that swing or hang. "
            "Diagnose pulled tissue one recording after the other, each with --base of the one before."
        )
    if settings.base == "elastic":
        raise Problem(
            "config key 'diagnosis.base': 'elastic' is for bodies that swing or hang; pulled tissue is diagnosed "
            "beside a base with viscosity. Leave it at 'viscous'."
        )
    if held_out is not None:
        same_body(clip, [clip_of(held_out, share=settings.grid)])
    diagnosis, physics, mismatch = diagnose(seen[0], settings, progress, memo)
    x = np.array([np.log(diagnosis.base["E"]["value"]), diagnosis.base["nu"]["value"], clip.prior.middle[2]])
    told = responses(clip, x)
    diagnosis = replace(diagnosis, global_test={**diagnosis.global_test, "responses": told.told()})
    if held_out is not None:
        diagnosis = foretold(diagnosis, physics, held_out)
    return diagnosis, physics, mismatch


def foretold(diagnosis: Diagnosis, physics: Physics, held_out: Recording) -> Diagnosis:
    """With how far simulations with the base, and with what is named, are off a recording that was never fitted."""
    share = physics.grid["spacing"] / float(np.cbrt(held_out.mesh.volume))
    clip = clip_of(held_out, share=share)
    clip = replace(clip, body=held_out.body(min(physics.grid["spacing"], spacing_of(held_out.mesh, share))))
    course, values = whole(clip), values_of(physics)
    named = {e["term"] for e in diagnosis.effects} if diagnosis.verdict in ("named", "equivalence class") else set()
    places = {
        n: Place(tuple(p["center"]), p["extent"], None if p["normal"] is None else tuple(p["normal"]))
        for n, p in physics.places.items()
    }
    base = {n: v for n, v in values.items() if n not in named}
    errors = {"recording": held_out.name, "unit": "mm"}
    try:
        errors["before"] = 1e3 * course.rms(simulate(clip, base, {}, course.until))
        errors["after"] = 1e3 * course.rms(simulate(clip, values, places, course.until)) if named else None
    except Breakdown as error:
        raise Problem(f"recording {held_out.name}, held out: {error}") from error
    said = f" Recording {held_out.name}, which was never fitted, is {errors['before']:.2g} mm off the base"
    said += f", {errors['after']:.2g} mm off with what is named." if named else "."
    return replace(diagnosis, words=diagnosis.words + said, foretold=errors)
