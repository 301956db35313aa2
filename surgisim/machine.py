"""What this machine is made of, as its own files and tools say."""

import platform
import subprocess
from pathlib import Path

GIB = 2**30


def processor() -> str:
    """The processor's own name."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.machine()


def memory() -> tuple[float, float]:
    """Total and available [GiB]."""
    lines = (line.split() for line in Path("/proc/meminfo").read_text().splitlines())
    kilobytes = {words[0].rstrip(":"): int(words[1]) for words in lines}
    return kilobytes["MemTotal"] * 1024 / GIB, kilobytes["MemAvailable"] * 1024 / GIB


def graphics() -> list[str]:
    """Names of NVIDIA's cards; empty without any, or without their driver."""
    try:
        command = ["nvidia-smi", "--query-gpu=name", "--format=csv,noheader"]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    except (OSError, subprocess.CalledProcessError):
        return []
