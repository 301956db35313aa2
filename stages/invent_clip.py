"""Film tissue that conceals some physics, or none, and seal what it conceals.

writes  clip.mp4     what an endoscope saw, for everybody
        seal.txt     sha256(truth + salt), for everybody, before any diagnosis
        truth.json, truth.npz, salt.txt   what only the scorer opens; keep them in another place
"""

from surgisim.config.invent import InventClip
from surgisim.stage import Bytes, stage

FILES = {"clip": ".mp4", "seal": ".txt", "truth": ".json", "truth_tracks": ".npz", "salt": ".txt"}


@stage(reads={}, writes={name: Bytes(suffix) for name, suffix in FILES.items()}, settings=InventClip)
def main(*, settings: InventClip, progress):
    from surgisim.phantom import seal
    from surgisim.phantom.filmed import film_concealed

    made, salt = film_concealed(settings, progress), seal.salt()
    return made.clip, seal.seal(made.truth, salt).encode(), made.truth, made.tracks, salt.encode()


if __name__ == "__main__":
    main()
