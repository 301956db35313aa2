"""Where jobs find Python and its packages: beside this Snakemake, or in what `--sdm conda` and `--sdm apptainer` make."""

DEPLOYED = {
    method.name.lower() for method in workflow.deployment_settings.deployment_method
}


def image(family):
    """The family's image, as the config names it: a file from here, or an address."""
    named = getattr(PLAN.choices.containers, family)
    if not named:
        raise WorkflowError(
            f"config key 'containers.{family}' is empty, and --sdm apptainer runs each stage in its image. Build"
            f" envs/{family}.Dockerfile and name the image there, or leave --sdm apptainer out."
        )
    if "://" in named:
        return named
    if not Path(named).exists():
        raise WorkflowError(
            f"config key 'containers.{family}': {Path(named).absolute()} is no file or folder. Build the image from"
            f" envs/{family}.Dockerfile, or name it by its address (docker://...)."
        )
    return str(Path(named).absolute())


def outside():
    """Folders that jobs read beside the one they run in: this checkout, recordings, weights."""
    named = {t for each in PLAN.slices.values() for t in _texts(json.loads(each))}
    files = [Path(text) for text in named if text.startswith("/")]
    files += [Path(clip.path) for clip in PLAN.clips.values() if clip.path]
    # Recordings that are diagnosed as they are, and not made here (robustness.smk, self_consistency.smk).
    files += [
        *map(Path, config.get("recordings", [])),
        Path(config.get("drawn_from", ROOT)),
    ]
    return sorted({str(ROOT), *(str(f.absolute().parent) for f in files if f.exists())})


def _texts(told):
    if isinstance(told, str):
        yield told
    elif isinstance(told, dict | list):
        for each in told.values() if isinstance(told, dict) else told:
            yield from _texts(each)


if "apptainer" in DEPLOYED:
    # A rule runs in the image of the family whose environment it names.
    for each in workflow.rules:
        family = Path(str(each.conda_env)).stem
        if each.conda_env and family in Containers.model_fields:
            each.container_img = image(family)
    for folder in outside():
        bound = f" --bind '{folder}'"
        if bound not in workflow.deployment_settings.apptainer_args:
            workflow.deployment_settings.apptainer_args += bound


# How many jobs may compute on GPUs at once, for lease.py.
AT_ONCE = workflow.global_resources.get("gpu")

# Snakemake passes a job's threads on as OMP_NUM_THREADS only (OpenCV would take all of a machine, beside frames that are
# worked on side by side already); and a stage must run with this checkout's library. This Python comes first in PATH only
# where no environment is made for the job: there it would hide that one's.
shell.prefix(
    "set -euo pipefail; export NUMBA_NUM_THREADS=$OMP_NUM_THREADS OPENCV_FOR_THREADS_NUM=1"
    " MPLBACKEND=Agg PYTHONHASHSEED=0 PYTHONFAULTHANDLER=1"
    f" SURGISIM_GPU_JOBS={AT_ONCE.value if AT_ONCE else 0}"
    f" SURGISIM='{ROOT}' PYTHONPATH='{ROOT}'"
    + ("" if DEPLOYED else f" PATH='{Path(sys.executable).parent}':$PATH")
    + "; "
)
