"""Run a command with GPUs of its own: `python lease.py COUNT COMMAND...`.

Snakemake counts GPUs but does not hand them out. A file lock per place on a GPU does; it falls with the process,
however that ends. A GPU has one place, or more where more jobs may compute at once (SURGISIM_GPU_JOBS) than there are
GPUs. Under SLURM the scheduler has already handed them out.
"""

import fcntl
import itertools
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path


def main(count: int, command: list[str]) -> None:
    if count == 0:
        # What a job may use is the profile's to say: none unless it says so.
        os.environ["CUDA_VISIBLE_DEVICES"] = ""
    elif "SLURM_JOB_ID" not in os.environ:
        os.environ["CUDA_VISIBLE_DEVICES"] = ",".join(_take(count))
    os.execvp(command[0], command)


def _take(count: int) -> list[str]:
    """Names of `count` GPUs with a free place, the emptiest first, waited for; the locks live as long as this
    process."""
    known = gpus()
    if len(known) < count:
        sys.exit(f"error: {count} GPUs are wanted and this machine shows {len(known)}. Use --profile default.")
    places = max(-(-int(os.environ.get("SURGISIM_GPU_JOBS", "0")) // len(known)), 1)
    folder = Path(tempfile.gettempdir()) / f"surgisim-gpus-{os.getuid()}"
    folder.mkdir(exist_ok=True)
    while True:
        taken: dict[str, int] = {}
        for place, name in itertools.product(range(places), known):
            if name in taken:
                continue
            handle = os.open(folder / f"{name}-{place}", os.O_RDWR | os.O_CREAT)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                os.close(handle)
                continue
            taken[name] = handle
            if len(taken) == count:
                for held in taken.values():
                    os.set_inheritable(held, True)
                return list(taken)
        for held in taken.values():
            os.close(held)
        time.sleep(1.0)


def gpus() -> list[str]:
    """Names of the GPUs this process may see."""
    if visible := os.environ.get("CUDA_VISIBLE_DEVICES"):
        return visible.split(",")
    try:
        found = subprocess.run(
            ["nvidia-smi", "--query-gpu=index", "--format=csv,noheader"], capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):
        return []
    return found.stdout.split()


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2:])
