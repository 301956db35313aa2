"""What the rules share: which clips and variants, where an output lies, which settings and code a stage has."""

import functools
import json
import sys
from pathlib import Path

# Of this file, and not of the workflow, which may be another one that uses this one as a module.
ROOT = Path(workflow.current_basedir.get_path_or_uri(secret_free=False)).parents[1]
sys.path.insert(0, str(ROOT))

from surgisim.clips import Clip, invented
from surgisim.config.base import parse as checked
from surgisim.config.containers import Containers
from surgisim.config.diagnosis import Diagnosing
from surgisim.config.invent import FAMILIES, Invent, InventClip
from surgisim.config.study import PARTS as STUDIED
from surgisim.config.whole import PARENTS
from surgisim.digest import digest
from surgisim.perception.ingest.archive import is_film
from surgisim.phantom.family import family, told_focal
from surgisim.plan import plan, table_of
from surgisim.problem import Problem
from surgisim.proof.known.catalogue import catalogue as known_recordings
from surgisim.proof.shuffle import partner

# What the rules for concealed recordings read of the config, beside the clips' choices.
BLIND = (
    "tier",
    "seed",
    "seeds",
    "cases",
    "invent",
    "bodies",
    "before",
    "recordings",
    "drawn_from",
    "draws",
)

# Concealed recordings (blind.smk): what is seen of them, which seed (several on one board: `seeds`), and how many cases.
# Tracks come of our own blocks of elements, or of a family of generators.
TIERS = {
    "tracks": "",
    "video": "video-",
    **{family: f"{family}-" for family in FAMILIES},
}
TIER = config.get("tier", "tracks")
if TIER not in TIERS:
    raise WorkflowError(f"config key 'tier' is {TIER!r}; {list(TIERS)} are known.")
SEED, COUNT = int(config.get("seed", 1)), int(config.get("cases", 40))
SEEDS = [int(seed) for seed in config.get("seeds", [SEED])]


def room(seed):
    """The folder of a seed's cases under blind/, which tells the tier."""
    return f"{TIERS[TIER]}{seed}"


def filmed():
    """Clips that conceal something or nothing, by name: all that the graph gets to know is the mp4, and maybe its focal."""
    return {
        f"{room(seed)}-{case}": Clip(
            f"{room(seed)}-{case}",
            Path(f"blind/{room(seed)}/{case}/clip.mp4"),
            {"ingest": {"focal": told_focal(seed, case)}},
        )
        for seed in SEEDS
        for case in range(COUNT)
    }


# A number of clips, `clips=40 seed=3`, asks for as many of the phantom's family instead of those of a table.
CLIPS = config.get("clips", ROOT / "config" / "clips.tsv")
try:
    PLAN = plan(
        {
            key: value
            for key, value in config.items()
            if key not in ("clips", "variants", *BLIND)
        },
        clips=(
            filmed()
            if TIER == "video"
            else (
                invented(family(SEED, int(CLIPS)))
                if str(CLIPS).isdigit()
                else table_of(config, "clips", ROOT / "config" / "clips.tsv")
            )
        ),
        variants=table_of(config, "variants", ROOT / "config" / "variants.yaml"),
    )
except Problem as problem:
    raise WorkflowError(str(problem)) from None


# Every variant, not only those that run: one that is not listed would turn shared files into "missing sources".
wildcard_constraints:
    clip="|".join(PLAN.clips),
    variant="|".join(PLAN.variants),


# The ten stages whose time and memory the tables show.
MEASURED = (
    "ingest",
    "masking",
    "inpainting",
    "correspondence",
    "depth",
    "tracking",
    "reconstruction",
    "thickening",
    "estimation",
    "simulation",
)


def upstream(stage, name):
    """Input function: where `stage` left `name` for this job's clip and variant."""
    return (
        lambda w: f"results/{w.clip}/{PLAN.homes[stage, w.clip, w.variant]}/{stage}/{name}"
    )


def settings(stage, name=None):
    """Params function: the slice of the settings this stage may read, and nothing else. name: the rule's, where it
    is not the stage's."""
    return placed(lambda w: PLAN.slices[stage, w.clip, w.variant], name or stage)


def drawn(w):
    """Params function: the report's settings, and every stage's settings and digest of code to put on the page."""
    stages = [
        stage for stage in PARENTS if stage != "phantom" or not PLAN.clips[w.clip].path
    ]
    told = {
        stage: json.loads(PLAN.slices[stage, w.clip, w.variant]) for stage in stages
    }
    codes = {stage: _code(stage) for stage in stages}
    return json.dumps({**told["report"], "stages": told, "code": codes}, sort_keys=True)


def chosen_runs():
    """Settings of every clip's first variant that runs, and what each other one changes, for the summary."""
    told = {}
    for clip in PLAN.clips:
        wholes = {
            v: {s: json.loads(PLAN.slices[s, clip, v]) for s in PARENTS}
            for v in PLAN.run
        }
        first = wholes[PLAN.run[0]]
        for variant, whole in wholes.items():
            changed = {s: group for s, group in whole.items() if group != first[s]}
            told[f"{clip}, {variant}"] = whole if whole is first else changed
    return told


def growing(amount):
    """Resource function: this much at first, and as much again with each attempt that failed."""
    return lambda wildcards, attempt: amount * attempt


# How many GPUs the profile, or the command line, gives each job of a rule (`set-resources`).
GIVEN = {
    name: given["gpu"].value
    for name, given in workflow.resource_settings.overwrite_resources.items()
    if "gpu" in given
}


def placed(chosen, name):
    """Params function: what `chosen` says, on the GPU where jobs of the rule are given one."""

    # Not asked of the job: Snakemake forgets that settings changed where what tells them looks at resources.
    def of(wildcards):
        said = chosen(wildcards)
        told = json.loads(said)
        if not (GIVEN.get(name) and "device" in told):
            return said
        return json.dumps(told | {"device": "cuda"}, sort_keys=True)

    return of


def products(rules):
    """Every file of every clip and variant that runs, those that are shared once."""
    # Not the reports alone: where a stage failed, what came after it still lies there from the time before,
    # and Snakemake would take a missing file between up-to-date ends for one that nobody needs.
    made = {
        pattern.format(clip=clip, variant=PLAN.homes[stage, clip, variant])
        for clip in PLAN.clips
        for variant in PLAN.run
        for stage in PARENTS
        if stage != "phantom" or PLAN.clips[clip].path is None
        for pattern in getattr(rules, stage).output
    }
    return sorted(made)


@functools.cache
def _code(stage):
    return digest(ROOT / "stages" / f"{stage}.py", ROOT)


def code(stage):
    """Params function: a digest of all code the stage imports, which Snakemake itself does not see."""
    return lambda w: _code(stage)


def recording(w):
    """The user's recording, or the embedded one."""
    return PLAN.clips[w.clip].path or upstream("phantom", "clip.mp4")(w)


def truth(w):
    """What is true of the embedded clip; nothing for a recording."""
    return [] if PLAN.clips[w.clip].path else upstream("phantom", "truth.npz")(w)


def benchmarks(w):
    """Where the stages of this clip and variant, some of them shared, left their time and memory."""
    homes = ((stage, PLAN.homes[stage, w.clip, w.variant]) for stage in MEASURED)
    return ":".join(f"benchmarks/{w.clip}/{home}/{stage}.tsv" for stage, home in homes)


# The files of a recording.
FILES = (
    "recording.json",
    "rest.ply",
    "fixed.json",
    "grip.npz",
    "tracks.npz",
    "split.json",
)

# Ways to diagnose the same cases: the method; the same with one of its parts left out, to see what each is worth; the
# method on clips that end sooner; and on paths that belong to another case, which must bring naming down to chance.
ABLATIONS = {
    "iid": {"noise": "independent"},
    "no_offset": {"offsets": False},
    "no_nulls": {"calibrated": False},
    "no_model_error": {"model_error": 0.0},
    "no_cause_map": {"cause": "symptom"},
}
SHORTER = {"until_load": "load", "until_hold": "hold"}
WAYS = {"main": {}, "shuffled": {}, **dict.fromkeys(SHORTER, {}), **ABLATIONS}

# Which are put side by side on one page.
BESIDE = {"ablations": ["main", *ABLATIONS], "phases": ["main", *SHORTER]}

# Real recordings with a known cause (known.smk).
KNOWN = known_recordings()
# Of each: what is diagnosed, what is held out, and what tells the base, as far as there is one.
PARTS = ("recording", "hold_out", "bare")


def known_hold_out(w):
    """The files of the recording that a known one is held against, if it has one."""
    held = KNOWN[w.known].hold_out is not None
    return [f"known/{w.known}/hold_out/{name}" for name in FILES] if held else []


def known_base(w):
    """What another recording tells of a known one's base, if it has one."""
    return f"known/{w.known}/base/physics.json" if KNOWN[w.known].bare else []


def known_beside(w, input):
    """Params function: the flags of a diagnosis for what stands beside a known recording."""
    held = f"--hold-out {Path(input.hold_out[0]).parent}" if input.hold_out else ""
    return f"{held} --base {input.base}" if input.base else held


def inventing(w):
    """Params function: what the phantom may choose from, checked here so that a mistake is said before anything runs."""
    told = {
        **config.get("invent", {}),
        "seed": number(getattr(w, "seed", SEED)),
        "case": int(w.case),
    }
    family = str(getattr(w, "seed", "")).rpartition("-")[0]
    if family in FAMILIES:
        told["family"] = family
    kind = InventClip if family == "video" else Invent
    try:
        return json.dumps(checked(kind, told, "config key 'invent'").model_dump())
    except Problem as problem:
        raise WorkflowError(str(problem)) from None


def diagnosing(w):
    """Params function: the config's settings of a diagnosis, with what this way or this known recording changes."""
    return with_changes(WAYS[w.way] if hasattr(w, "way") else KNOWN[w.known].settings)


def with_changes(changes):
    """The config's settings of a diagnosis with others laid over them, as JSON."""
    told = {**PLAN.choices.diagnosis.model_dump(), **changes}
    return json.dumps(checked(Diagnosing, told, "diagnosis").model_dump(mode="json"))


def shown(w):
    """The files of the recording that this way of diagnosing gets to see."""
    if w.way == "shuffled" or w.way in SHORTER:
        return [f"blind/{w.seed}/{w.case}/{w.way}/recording/{name}" for name in FILES]
    return whole(w)


def whole(w):
    """The files of a case's recording: as it was invented, or what the graph made of its clip."""
    return [f"{home(w.seed, w.case)}/{name}" for name in FILES]


def home(seed, case):
    """The folder of a case's whole recording."""
    if is_filmed(seed):
        return f"results/{seed}-{case}/main/diagnosis/recording"
    return f"blind/{seed}/{case}/recording"


def is_filmed(seed):
    """Whether the cases in a seed's folder are clips."""
    return str(seed).startswith(TIERS["video"])


def recordings(w):
    """The first file of every case's whole recording."""
    return [f"{home(w.seed, case)}/{FILES[0]}" for case in range(COUNT)]


def camera(w):
    """What the graph took the camera of a case's clip to be; nothing of a recording that was no clip."""
    return (
        f"results/{w.seed}-{w.case}/main/ingest/camera.json"
        if is_filmed(w.seed)
        else []
    )


def number(seed):
    """A seed without its tier."""
    return int(str(seed).rpartition("-")[2])


def others(w):
    """The files of the recording whose paths this case gets when they are shuffled."""
    other = partner(int(w.case), COUNT, number(w.seed))
    return [f"blind/{w.seed}/{other}/recording/{name}" for name in FILES]


def folder(w, input):
    """Params function: where the rule's recording lies."""
    return Path(input.recording[0]).parent


def work(w, output):
    """Params function: where a diagnosis keeps finished runs until it is written."""
    # Not among the outputs: those of an interrupted job are deleted, and these are what its second start goes on from.
    return Path(output.diagnosis).parent / "work"


def every(pattern):
    """Input function: a file of every case of the run."""
    return lambda w: expand(
        pattern, seed=w.seed, case=range(COUNT), way=getattr(w, "way", "main")
    )


# The paper's tables (tables.smk): variants simulated, variants of the scene alone, and seeds of its fit.
TABLED = ("main", "elastic_default", "point_cloud", "mesh")
TERMS = ("main", "no_trajectory", "no_anisotropy", "no_both")
AGAIN = [0, 1, 2]


def with_depth(clip):
    """Whether depth of its own may come with a clip: no film has any."""
    path = PLAN.clips[clip].path
    return path is None or not is_film(path)


def receipt():
    """Digest of every stage's code, and the settings of every clip and variant that the tables show."""
    shown = {*TABLED, *TERMS, "near_light"}
    stages = [*MEASURED, "evaluation", "scene_score"]
    return {
        "code": {stage: _code(stage) for stage in stages},
        "settings": {
            clip: {
                variant: {
                    stage: json.loads(PLAN.slices[stage, clip, variant])
                    for stage in MEASURED
                    if variant == "main"
                    or PLAN.slices[stage, clip, variant]
                    != PLAN.slices[stage, clip, "main"]
                }
                for variant in sorted(shown)
            }
            for clip in PLAN.clips
        },
        "seeds": AGAIN,
    }


# Cases of the seed that are shown: the first ones, whatever they are.
SHOWN_CASES = range(min(COUNT, 6))


def shown_cases(pattern):
    """The file of every concealed case that is shown."""
    return [pattern.format(seed=room(SEED), case=case) for case in SHOWN_CASES]


def shown_clips(stage, name):
    """Where `stage` left `name` of every clip."""
    return [
        f"results/{clip}/{PLAN.homes[stage, clip, 'main']}/{stage}/{name}"
        for clip in PLAN.clips
    ]
