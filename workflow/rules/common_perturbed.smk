"""What the rules for perturbed and drawn recordings share: which there are, and what each diagnosis gets to see."""

import re

from surgisim.config.draws import OF_NULLS
from surgisim.proof.perturb.names import AS_IS, INVENTED, KEYED, KEYLESS
from surgisim.proof.perturb.names import SETTINGS as OTHER_SETTINGS
from surgisim.proof.robustness import LAWS, RATIO, bodies

PERTURBED = dict.fromkeys((*KEYED, *KEYLESS))
OF_BODIES = [AS_IS, *KEYED, *INVENTED]
OF_RECORDINGS = [AS_IS, *KEYLESS, *OTHER_SETTINGS]

# Recordings without a key, each under its folder's name, or that of the folder around it.
ASKED = {}
for path in map(Path, config.get("recordings", [])):
    ASKED[path.parent.name if path.name == "recording" else path.name] = path
if not ASKED:
    ASKED = {
        name: Path(f"known/{name}/recording")
        for name, known in KNOWN.items()
        if known.convert
    }


DRAWS = int(config.get("draws", 100))


@functools.cache
def chosen_bodies():
    """Cases of the run's seed; asked for only where a rule needs them, because the phantom is slow to load."""
    return bodies(SEED, int(config.get("bodies", 12)))


def of_every_body(pattern):
    """Input function: a file of every body of the run, of every perturbation if it names one."""
    return lambda w: expand(
        pattern, seed=SEED, body=chosen_bodies(), perturbation=OF_BODIES
    )


def embodied(w):
    """Params function: what a body is invented with."""
    told = {
        **config.get("invent", {}),
        "seed": int(w.seed),
        "case": int(w.body),
        "snr_low": RATIO,
        "only": LAWS,
        **INVENTED.get(getattr(w, "again", None), {}),
    }
    try:
        return json.dumps(checked(Invent, told, "config key 'invent'").model_dump())
    except Problem as problem:
        raise WorkflowError(str(problem)) from None


def unperturbed(w):
    """The files of the recording as it is."""
    if w.home.startswith("robustness/"):
        return [f"{w.home}/recording/{name}" for name in FILES]
    # What every recording has; grips and a split only some.
    needed = ("recording.json", "rest.ply", "fixed.json", "tracks.npz")
    return [ASKED[w.home.removeprefix("metamorphic/")] / name for name in needed]


def seen(w):
    """The files of the recording that a diagnosis under this name gets to see."""
    if w.perturbation == AS_IS or w.perturbation in OTHER_SETTINGS:
        return unperturbed(w)
    return [f"{w.home}/{w.perturbation}/recording/{name}" for name in FILES]


def noise_free(w):
    """The true paths, from which noise is drawn anew; nobody has those of a real recording."""
    return f"{w.home}/sealed/truth.npz" if w.home.startswith("robustness/") else []


def diagnosing_perturbed(w):
    """Params function: as ever, or otherwise where that is what is tried."""
    own = KNOWN.get(w.home.removeprefix("metamorphic/"))
    return with_changes(
        {**(own.settings if own else {}), **OTHER_SETTINGS.get(w.perturbation, {})}
    )


def earlier(room):
    """Where another version left its diagnoses, as a flag."""
    return f"--before {config['before']}/{room}" if "before" in config else ""


def drawn_from(w):
    """What every recording has of the one that is drawn from: a body that conceals nothing, unless one is given."""
    place = config.get(
        "drawn_from", f"robustness/{SEED}/{chosen_bodies()[0]}/recording"
    )
    needed = ("recording.json", "rest.ply", "fixed.json", "tracks.npz")
    return [Path(place) / name for name in needed]
