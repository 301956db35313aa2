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
    import json

    import numpy as np

    from surgisim.proof.perturb.catalogue import perturbed
    from surgisim.recordings.folder import encoded_recording, read_recording

    true = np.load(truth_tracks)["true"].astype(float) if truth_tracks else None
    own = read_recording(recording)
    made = perturbed(settings.name, own, settings.seed, true)
    # A recording without a split gets the one that a reader would give it, so that all have the same files.
    files = {"split.json": json.dumps({"fit": [0, made.fitted_until], "held_out": list(made.held_out)}).encode()}
    files |= encoded_recording(made)
    return tuple(files[name] for name in ("recording.json", *(f"{n}{s}" for n, s in list(FILES.items())[1:])))


if __name__ == "__main__":
    main()
