"""Write one drawn recording as a folder.

reads   the recording folder that was drawn from, and draws.npz
writes  the folder's files; only paths and the name differ, and points that no diagnosis uses are left out
"""

from surgisim.config.draws import Draw
from surgisim.stage import Bytes, Source, stage

FILES = {"drawn": ".json", "rest": ".ply", "fixed": ".json", "grip": ".npz", "tracks": ".npz", "split": ".json"}


@stage(
    reads={"recording": Source("a recording folder"), "draws": Source("draws.npz")},
    writes={name: Bytes(suffix) for name, suffix in FILES.items()},
    settings=Draw,
)
def main(recording, draws, *, settings, progress):
    import numpy as np

    from surgisim.proof.self_consistency import recorded
    from surgisim.proof.six_files import six_files
    from surgisim.recordings.folder import read_recording

    with np.load(draws) as made:
        kept, rest, moved = made["kept"], made["rest"], made["moved"][settings.number]
    return six_files(recorded(read_recording(recording), kept, rest, moved, settings.number))


if __name__ == "__main__":
    main()
