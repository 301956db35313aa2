"""Fill in the tissue that the instrument hides.

reads   frames.npz, masks.npz
writes  inpainted.npz  Inpainted
"""

from surgisim.artifacts.frames import Frames
from surgisim.artifacts.inpainted import Inpainted
from surgisim.artifacts.masks import Masks
from surgisim.config.inpainting import Inpainting
from surgisim.stage import stage


@stage(reads={"frames": Frames, "masks": Masks}, writes={"inpainted": Inpainted}, settings=Inpainting)
def main(frames, masks, *, settings, progress):
    from surgisim.perception.inpainting.removal import without_tool

    return without_tool(frames, masks, settings, progress=progress)


if __name__ == "__main__":
    main()
