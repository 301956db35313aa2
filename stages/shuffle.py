"""Give a recording another case's paths, to see whether anything but paths tells the law.

reads   two recording folders
writes  the first's files with the second's paths
"""

from surgisim.config.base import Settings
from surgisim.stage import Bytes, Source, stage

FILES = {"shuffled": ".json", "rest": ".ply", "fixed": ".json", "grip": ".npz", "tracks": ".npz", "split": ".json"}


@stage(
    reads={"recording": Source("a recording folder"), "other": Source("the folder whose paths it gets")},
    writes={name: Bytes(suffix) for name, suffix in FILES.items()},
    settings=Settings,
)
def main(recording, other, *, settings, progress):
    from surgisim.proof.shuffle import shuffled
    from surgisim.recordings.folder import encoded_recording, read_recording

    files = encoded_recording(shuffled(read_recording(recording), read_recording(other)))
    return tuple(files[name] for name in ("recording.json", *(f"{n}{s}" for n, s in list(FILES.items())[1:])))


if __name__ == "__main__":
    main()
