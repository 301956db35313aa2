"""Let a recording be fitted only up to some phase, to see what a clip that ends there could tell.

reads   a recording folder
writes  the same files; only split.json differs
"""

from surgisim.config.shorten import Shorten
from surgisim.stage import Bytes, Source, stage

FILES = {"shortened": ".json", "rest": ".ply", "fixed": ".json", "grip": ".npz", "tracks": ".npz", "split": ".json"}


@stage(
    reads={"recording": Source("a recording folder")},
    writes={name: Bytes(suffix) for name, suffix in FILES.items()},
    settings=Shorten,
)
def main(recording, *, settings, progress):
    from surgisim.proof.shorten import shortened
    from surgisim.recordings.folder import encoded_recording, read_recording

    files = encoded_recording(shortened(read_recording(recording), settings.end))
    return tuple(files[name] for name in ("recording.json", *(f"{n}{s}" for n, s in list(FILES.items())[1:])))


if __name__ == "__main__":
    main()
