"""A copy of the project in which every stage costs nothing: it reads its flags and writes a line.

A cheap stage keeps the text of the real one below its exit, so that it imports the same files.
"""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[1]

CHEAP = '''"""Write one line to every output."""
import sys
from pathlib import Path

FIT = (
    '{"header": {"kind": "Fit"}, "history": [], "identifiability": {}, "held_out": {}, "words": "Not fitted.", '
    '"numerical_damping": null}'
)
stage = Path(__file__).stem
if (Path(__file__).parents[1] / "broken").exists() and stage in (Path(__file__).parents[1] / "broken").read_text():
    sys.exit("error: " + stage + " is broken on purpose.")
inputs = [Path(a) for a in sys.argv[1:] if "/" in a and not a.startswith(("benchmarks/", "{"))]
for path in inputs:
    if stage == path.parent.name or stage == path.stem == "summary":
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(FIT if path.name == "fit.json" else stage)
sys.exit()
'''


@dataclass
class Tree:
    """The copy, and what happens when Snakemake runs in it."""

    root: Path
    out: Path
    choices: dict = field(default_factory=dict)

    def plan(self, *arguments: str) -> set[tuple[str, ...]]:
        """(rule, wildcard values...) of every job that a dry run would start."""
        said = self._snakemake("--dry-run", *arguments)
        events = [json.loads(line) for line in said.stdout.splitlines() if line.startswith('{"event"')]
        assert said.returncode == 0, [e["text"] for e in events if e["level"] == "ERROR"]
        jobs = [e for e in events if e["event"] == "job_info"]
        return {(job["rule_name"], *job["wildcards"].values()) for job in jobs if job["rule_name"] != "all"}

    def commands(self, *arguments: str) -> list[str]:
        """The shell command of every job that a dry run would start."""
        said = self._snakemake("--dry-run", "--printshellcmds", *arguments)
        assert said.returncode == 0, said.stdout
        events = [json.loads(line) for line in said.stdout.splitlines() if line.startswith('{"event"')]
        return [event["text"] for event in events if event["event"] == "shellcmd"]

    def rules(self, *arguments: str) -> set[str]:
        return {job[0] for job in self.plan(*arguments)}

    def run(self, *arguments: str) -> int:
        return self._snakemake(*arguments).returncode

    def says(self, *arguments: str) -> str:
        """What a run that fails says."""
        said = self._snakemake(*arguments)
        assert said.returncode != 0
        return said.stdout

    def edit(self, path: str, more: str = "\n# edited\n") -> None:
        with open(self.root / path, "a") as stream:
            stream.write(more)

    def surgisim(self, *arguments: str) -> subprocess.CompletedProcess:
        """The command line, in the copy."""
        command = [sys.executable, "-m", "surgisim.cli", *arguments]
        return subprocess.run(command, cwd=self.root, env=self.environment(), capture_output=True, text=True)

    def _snakemake(self, *arguments: str) -> subprocess.CompletedProcess:
        self.out.mkdir(exist_ok=True)
        chosen = [f"{key}={json.dumps(value)}" for key, value in self.choices.items()]
        command = [sys.executable, "-m", "snakemake", "--snakefile", str(self.root / "workflow" / "Snakefile")]
        command += ["--directory", str(self.out), "--cores", "2", "--logger", "surgisim", *arguments]
        command += ["--config", *chosen] if chosen else []
        return subprocess.run(command, env=self.environment(), capture_output=True, text=True)

    def environment(self) -> dict[str, str]:
        """With the copy first on the path, so that its own library is what runs."""
        paths = [self.root, self.root / "workflow" / "logger"]
        return os.environ | {"PYTHONPATH": os.pathsep.join(map(str, paths)), "COLUMNS": "500"}


def cheap_tree(folder: Path) -> Tree:
    root = folder / "project"
    ignored = shutil.ignore_patterns("__pycache__")
    for name in ("surgisim", "stages", "workflow", "config", "envs"):
        shutil.copytree(ROOT / name, root / name, ignore=ignored)
    for script in (root / "stages").glob("*.py"):
        script.write_text(CHEAP + script.read_text())
    return Tree(root, folder / "out")
