"""Turn a real recording whose cause is known into a recording folder, in which nothing says what the cause is.

reads   the data's own files, in a folder of SURGISIM_DATA
writes  recording.json, rest.ply, fixed.json, grip.npz, tracks.npz, split.json
"""

from surgisim.config.known import Known
from surgisim.stage import Bytes, stage

FILES = {"recording": ".json", "rest": ".ply", "fixed": ".json", "grip": ".npz", "tracks": ".npz", "split": ".json"}


@stage(reads={}, writes={name: Bytes(suffix) for name, suffix in FILES.items()}, settings=Known)
def main(*, settings, progress):
    from surgisim.proof.known.catalogue import chosen
    from surgisim.recordings.folder import encoded_recording
    from surgisim.verification.cases import data

    known = chosen(settings.case)
    files = encoded_recording(known.part(settings.part)(data(known.data)))
    return tuple(files[f"{name}{suffix}"] for name, suffix in FILES.items())


if __name__ == "__main__":
    main()
