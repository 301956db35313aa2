"""A stage that writes 200 kB of noise in two files, killed before a rename if told so."""

import os

import numpy as np

from surgisim.artifacts.frames import Frames
from surgisim.config.base import Settings
from surgisim.stage import stage


class Noise(Settings):
    seed: int = 0
    kill_before_rename: int = 0


@stage(reads={}, writes={"first": Frames, "second": Frames}, settings=Noise)
def main(*, settings, progress):
    rgb = np.random.default_rng(settings.seed).integers(0, 256, (2, 128, 128, 3), np.uint8)
    renamed = []

    def replace(source, target, real=os.replace):
        renamed.append(target)
        if len(renamed) == settings.kill_before_rename:
            os.kill(os.getpid(), 9)
        real(source, target)

    os.replace = replace
    frames = Frames(rgb, np.zeros(2, np.uint8))
    return frames, frames


if __name__ == "__main__":
    main()
