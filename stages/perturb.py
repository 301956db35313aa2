"""Say a recording's facts as somebody else might have: a frame, a millimetre or a per cent apart.

reads   a recording folder; the noise-free paths of its truth.npz, where a perturbation asks for them
writes  the folder's files, perturbed
"""

from surgisim.config.perturb import Perturb
from surgisim.stage import Bytes, Source, stage

FILES = {"perturbed": ".json", "rest": ".ply", "fixed": ".json", "grip": ".npz", "tracks": ".npz", "split": ".json"}


@stage(
    reads={
        "recording": Source("a recording folder"),
        "truth_tracks": Source("truth.npz of a phantom's recording", required=False),
    },
    writes={name: Bytes(suffix) for name, suffix in FILES.items()},
    settings=Perturb,
)
def main(recording, truth_tracks, *, settings, progress):
    import numpy as np

    from surgisim.proof.perturb.catalogue import perturbed
    from surgisim.proof.six_files import six_files
    from surgisim.recordings.folder import read_recording

    true = np.load(truth_tracks)["true"].astype(float) if truth_tracks else None
    return six_files(perturbed(settings.name, read_recording(recording), settings.seed, true))


if __name__ == "__main__":
    main()
