"""Follow every pixel of the tissue that frame 0 shows through the recording.

reads   frames.npz, masks.npz
writes  correspondence.npz  Correspondence [px]
"""

from surgisim.artifacts.correspondence import Correspondence
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.masks import Masks
from surgisim.config.correspondence import Correspondence as Settings
from surgisim.stage import stage


@stage(
    reads={"frames": Frames, "masks": Masks},
    writes={"correspondence": Correspondence},
    settings=Settings,
)
def main(frames, masks, *, settings, progress):
    from surgisim.perception.tracking.correspond import correspond

    return correspond(frames, masks, settings, progress=progress)


if __name__ == "__main__":
    main()
