"""What the user asked for, written down beside the results, run, and answered."""

import importlib.util
import re
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from rich.console import Console
from rich.markup import escape

from surgisim.artifacts.base import load
from surgisim.artifacts.fit import Fit
from surgisim.artifacts.verdict import read_verdict
from surgisim.clips import EMBEDDED, SHORT, merge_entry, value
from surgisim.config.base import parse
from surgisim.config.diagnosis import Diagnosing
from surgisim.config.whole import PARENTS, Whole, rooted
from surgisim.follow import follower
from surgisim.launch import State, home, launch, why
from surgisim.plan import Plan, merged, plan, read_variants
from surgisim.problem import Problem, nearest


@dataclass(frozen=True, kw_only=True)
class Order:
    clip: str
    """A recording, a table of clips, or the name of the embedded one."""
    name: str
    out: Path
    variants: tuple[str, ...]
    book: Path | None
    """A variants.yaml of the user's own."""
    operation: Path | None
    """A new operation, run as a variant named after its file."""
    configs: tuple[Path, ...]
    settings: tuple[str, ...]
    """'stage.key=value' entries; they win over `configs`."""
    cores: str
    profile: str | None
    until: str | None
    diagnose: bool
    """Whether to say what the simulation lacks, too."""
    dry: bool
    debug: bool


def carry_out(order: Order) -> int:
    """Check, write results/run.yaml, run the graph; the exit code."""
    console = Console(highlight=False, soft_wrap=True)
    place, out = home(), order.out.resolve()
    arguments = _arguments(order)
    choices = chosen(order.configs, order.settings)
    base = yaml.safe_load((place / "config" / "config.yaml").read_text())
    known = read_variants(order.book or place / "config" / "variants.yaml")
    for variant in order.variants:
        if variant not in (*known, "all"):
            raise Problem(
                f"--variant {variant}: there is no such variant; did you mean '{nearest(variant, known)}'? Known: "
                f"{', '.join(known)}, and 'all'."
            )
    _writable(order.out)
    if order.variants:
        choices["run"] = list(known if "all" in order.variants else order.variants)
    if order.operation:
        title = called(order.operation)
        known[title] = {"simulation": {"operation": value(f"@{order.operation}", Path.cwd())}}
        choices["run"] = [*choices.get("run", base["run"]), title]
    variants = out / "results" / "variants.yaml"
    _write(variants, yaml.safe_dump(known, sort_keys=False))
    table = Path(order.clip).resolve() if order.clip.endswith(".tsv") else out / "results" / "clips.tsv"
    if not order.clip.endswith(".tsv"):
        _write(table, f"name\tpath\n{order.name}\t{_recording(order.clip)}\n")
    todo = plan(merged(base, choices), clips=table, variants=variants)
    _look_for(todo, table)
    written = out / "results" / "run.yaml"
    _write(written, yaml.safe_dump(choices | {"clips": str(table), "variants": str(variants)}))
    began = time.monotonic()
    arguments = ["--configfile", str(written), *arguments]
    try:
        with follower(console, quiet=order.dry or order.debug) as show:
            code, state = launch(out, arguments, show=show, debug=order.debug)
    except KeyboardInterrupt:
        console.print("stopped; the same command goes on from what was finished")
        return 130
    if order.dry and not code:
        _announce(console, state)
        return code
    return _answer(console, todo, out, code, state, order, time.monotonic() - began)


def called(path: Path) -> str:
    """A file's name as the name of a clip or a variant."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", path.name.removesuffix(path.suffix)).strip("_-") or "unnamed"


def chosen(configs: tuple[Path, ...], settings: tuple[str, ...]) -> dict[str, Any]:
    """The keys of config.yaml that the user changes, checked, with absolute paths."""
    total: dict[str, Any] = {}
    for path in configs:
        if not path.is_file():
            raise Problem(f"{path}: no such file, but --config names it.")
        try:
            raw = yaml.safe_load(path.read_text()) or {}
        except yaml.YAMLError as error:
            raise Problem(f"{path}: is not YAML ({' '.join(str(error).split())}).") from error
        if not isinstance(raw, dict):
            raise Problem(f"{path}: holds a {type(raw).__name__}, but keys of config.yaml are wanted there.")
        parse(Whole, raw, str(path))
        total = merged(total, rooted(raw, path.resolve().parent))
    for entry in settings:
        key, equals, text = entry.partition("=")
        if not equals:
            raise Problem(f"--set {entry}: STAGE.KEY=VALUE is wanted, for example ingest.size=160.")
        one: dict[str, Any] = {}
        # As they are given by options of their own, too.
        where = f"--{key.strip()} {text}" if key.strip() in SHORT else f"--set {entry}"
        merge_entry(one, key.strip(), text, Path.cwd(), where)
        parse(Whole, one, where)
        total = merged(total, rooted(one, Path.cwd()))
    return total


def of_diagnosis(configs: tuple[Path, ...], settings: tuple[str, ...]) -> Diagnosing:
    """How a recording is diagnosed, of the same files and flags; a flag may leave out the section's name."""
    keys = (entry if entry.startswith("diagnosis.") else f"diagnosis.{entry}" for entry in settings)
    return parse(Whole, chosen(configs, tuple(keys)), "diagnose").diagnosis


def of_picking(configs: tuple[Path, ...], settings: tuple[str, ...]) -> Whole:
    """The settings by which a clip is read and masked that is marked by hand."""
    return parse(Whole, chosen(configs, settings), "pick")


def _recording(clip: str) -> str:
    return EMBEDDED if clip == EMBEDDED else str(Path(clip).resolve())


def _look_for(todo: Plan, table: Path) -> None:
    for clip in todo.clips.values():
        if clip.path and not clip.path.exists():
            raise Problem(f"{clip.path}: no such video or folder, but clip '{clip.name}' is to be read from there.")


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.is_file() or path.read_text() != text:
        path.write_text(text)


def _writable(out: Path) -> None:
    try:
        (out / "results").mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=out / "results"):
            pass
    except OSError as error:
        why = (error.strerror or str(error)).lower()
        raise Problem(f"--out {out}: nothing can be written there ({why}). Choose another folder.") from error


def _arguments(order: Order) -> list[str]:
    arguments = ["--cores", order.cores]
    if order.profile:
        named = home() / "workflow" / "profiles" / order.profile
        folder = named if named.is_dir() else Path(order.profile).resolve()
        if not folder.is_dir():
            raise Problem(f"--profile {order.profile}: no such folder; known by name: {_profiles()}.")
        _executor(order.profile, folder)
        arguments += ["--profile", str(folder)]
    if order.until:
        stages = [*PARENTS, "summary"]
        if order.until not in stages:
            raise Problem(
                f"--until {order.until}: there is no such stage; did you mean '{nearest(order.until, stages)}'? Known: "
                f"{', '.join(stages)}."
            )
        arguments += ["--until", order.until]
    arguments += ["--dry-run"] if order.dry else []
    return [*arguments, "--", "all", "clip_diagnoses"] if order.diagnose else arguments


def _executor(name: str, folder: Path) -> None:
    """Whether what the profile hands its jobs to is there."""
    told = next((folder / f for f in ("config.yaml", "config.v8+.yaml", "config.yml") if (folder / f).is_file()), None)
    wanted = (yaml.safe_load(told.read_text()) or {}).get("executor") if told else None
    if wanted and wanted not in ("local", "dryrun", "touch"):
        package = f"snakemake-executor-plugin-{wanted}"
        if importlib.util.find_spec(package.replace("-", "_")) is None:
            raise Problem(
                f"--profile {name}: hands its jobs to '{wanted}', and the package {package} is not installed "
                f"beside this program. Add it: {sys.executable} -m pip install {package}."
            )


def _profiles() -> str:
    return ", ".join(sorted(p.name for p in (home() / "workflow" / "profiles").iterdir()))


def _announce(console: Console, state: State) -> None:
    for job in state.jobs.values():
        if job.rule != "all":
            console.print(f"would run {escape(job.name)}")
    if not state.jobs:
        console.print("everything is up to date")


def _answer(console: Console, todo: Plan, out: Path, code: int, state: State, order: Order, seconds: float) -> int:
    for job in state.failed:
        console.print(f"[red]error[/]: {escape(job.name)}: {escape(why(job, state.said))}")
    if code and not state.failed:
        said = state.complaints or state.said or ["Snakemake stopped without a word"]
        console.print(f"[red]error[/]: {escape(' '.join(said[-1 if order.debug else 0].split()))}")
    if code:
        console.print("The same command goes on from here once this is mended; what was finished is kept.")
        return (
            2 if state.failed and all(" fault of the program" not in why(j, state.said) for j in state.failed) else code
        )
    did = [job for job in state.jobs.values() if job.rule != "all"]
    console.print(f"{len(did)} jobs in {seconds:.0f} s" if did else "nothing to do: everything is up to date")
    for clip in todo.clips:
        for variant in todo.run:
            page = out / "results" / clip / variant / "report" / "report.html"
            if page.is_file():
                console.print(f"report   {escape(str(page))}")
            fit = out / "results" / clip / variant / "estimation" / "fit.json"
            if fit.is_file():
                console.print(f"         {escape(load(Fit, fit).words)}", soft_wrap=True)
            diagnosis = out / "results" / clip / variant / "diagnosis"
            if order.diagnose and (diagnosis / "diagnosis.html").is_file():
                console.print(f"lacks    {escape(str(diagnosis / 'diagnosis.html'))}")
                words = read_verdict(diagnosis / "diagnosis.json").words
                console.print(f"         {escape(words)}", soft_wrap=True)
    if (out / "results" / "summary.html").is_file():
        console.print(f"summary  {escape(str(out / 'results' / 'summary.html'))}")
    return 0
