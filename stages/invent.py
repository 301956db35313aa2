"""Invent a recording that conceals some physics, or none, and seal what it conceals.

writes  recording.json, rest.ply, fixed.json, grip.npz, tracks.npz, split.json   the recording, for everybody
        seal.txt     sha256(truth + salt), for everybody, before any diagnosis
        truth.json, truth.npz, salt.txt   what only the scorer opens; keep them in another place
"""

from surgisim.config.invent import Invent
from surgisim.stage import Bytes, stage

FILES = {
    "recording": ".json",
    "rest": ".ply",
    "fixed": ".json",
    "grip": ".npz",
    "tracks": ".npz",
    "split": ".json",
    "seal": ".txt",
    "truth": ".json",
    "truth_tracks": ".npz",
    "salt": ".txt",
}


@stage(reads={}, writes={name: Bytes(suffix) for name, suffix in FILES.items()}, settings=Invent)
def main(*, settings: Invent, progress):
    from surgisim.phantom import seal
    from surgisim.phantom.blind import invent
    from surgisim.phantom.families.blind import invent as of_family

    made = invent(settings, progress) if settings.family == "blocks" else of_family(settings, progress)
    salt = seal.salt()
    public = [made.recording[f"{name}{suffix}"] for name, suffix in list(FILES.items())[:6]]
    return *public, seal.seal(made.truth, salt).encode(), made.truth, made.tracks, salt.encode()


if __name__ == "__main__":
    main()
