"""A stage that is stopped at the worst moment leaves nothing that looks finished."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from surgisim.artifacts.base import save_bytes
from surgisim.artifacts.partial import partial

STAGE = Path(__file__).with_name("small_stage.py")


def run(folder: Path, **settings) -> subprocess.CompletedProcess:
    files = ["--first", str(folder / "first.npz"), "--second", str(folder / "second.npz")]
    command = [sys.executable, str(STAGE), *files, "--settings", json.dumps(settings)]
    return subprocess.run(command, capture_output=True, text=True)


@pytest.mark.parametrize("rename", [1, 2])
def test_killed_before_a_rename_and_started_again_gives_the_same_bytes(tmp_path, rename):
    calm, shaken = tmp_path / "calm", tmp_path / "shaken"
    assert run(calm).returncode == 0
    assert run(shaken, kill_before_rename=rename).returncode == -9
    assert not (shaken / "second.npz").exists()
    assert run(shaken).returncode == 0
    assert {p.name for p in shaken.iterdir()} == {"first.npz", "second.npz"}
    # The settings are part of the header, and the kill was one of them: compare with the undisturbed run.
    for name in ("first.npz", "second.npz"):
        assert (shaken / name).read_bytes() == (calm / name).read_bytes()


WRITER = """
import sys
from pathlib import Path
from surgisim.artifacts.partial import partial
with partial(Path(sys.argv[1])) as stream:
    print(stream.name, flush=True)
    sys.stdin.read()
    stream.write(b"theirs")
    Path(stream.name).rename(sys.argv[1])
"""


@pytest.mark.parametrize("killed", [False, True])
def test_what_another_process_is_writing_stays_until_it_is_done_or_dead(tmp_path, killed):
    path = tmp_path / "run.npz"
    command = [sys.executable, "-c", WRITER, str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        under_way = Path(other.stdout.readline().strip())
        save_bytes({path: b"mine"})
        assert path.read_bytes() == b"mine"
        assert under_way.is_file()
        if killed:
            other.kill()
        other.stdin.close()
        other.wait(30)
    assert path.read_bytes() == (b"mine" if killed else b"theirs")
    assert under_way.is_file() == killed
    save_bytes({path: b"mine"})
    assert os.listdir(tmp_path) == ["run.npz"]


def test_two_writers_of_one_process_write_two_files(tmp_path):
    with partial(tmp_path / "run.npz") as first, partial(tmp_path / "run.npz") as second:
        assert first.name != second.name
    assert os.listdir(tmp_path) == []


@pytest.fixture
def small_disk(tmp_path):
    """A file system with room for 100 kB."""
    place = tmp_path / "disk"
    place.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=100k", "tmpfs", str(place)], capture_output=True)
    if mounted.returncode:
        pytest.skip("NO SMALL DISK: mounting one needs root, so this test did not run.")
    yield place
    subprocess.run(["umount", str(place)], check=True)


def test_a_disk_that_fills_up_is_one_sentence_and_leaves_nothing(small_disk):
    done = run(small_disk)
    assert done.returncode == 3
    assert done.stderr.count("\n") == 1
    assert "the disk is full" in done.stderr
    assert str(small_disk) in done.stderr
    assert os.listdir(small_disk) == []


def test_settings_that_are_wrong_are_one_sentence_and_leave_nothing(tmp_path):
    done = run(tmp_path, seeed=3)
    assert done.returncode == 2
    assert done.stderr.startswith("error: small_stage: there is no key 'seeed'; did you mean 'seed'?")
    assert os.listdir(tmp_path) == []
