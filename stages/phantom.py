"""Invent a clip whose truth is known: soft tissue, an instrument that pulls it and lets go, an endoscope.

writes  clip.mp4     what the endoscope saw
        truth.npz    Truth: what only the inventor knows; opened for scoring
"""

from surgisim.artifacts.truth import Truth
from surgisim.config.phantom import Phantom
from surgisim.stage import Bytes, stage


@stage(reads={}, writes={"clip": Bytes(".mp4"), "truth": Truth}, settings=Phantom)
def main(*, settings: Phantom, progress):
    from surgisim.phantom.clip import film
    from surgisim.phantom.video import encode

    frames, truth = film(settings, progress)
    return encode(frames, settings.fps, settings.crf), truth


if __name__ == "__main__":
    main()
