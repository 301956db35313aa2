"""Tell the instrument from the tissue in every frame.

reads   frames.npz, given.npz, camera.json
writes  masks.npz  Masks
"""

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.artifacts.masks import Masks
from surgisim.config.masking import Masking
from surgisim.stage import stage


@stage(reads={"frames": Frames, "given": Given, "camera": Camera}, writes={"masks": Masks}, settings=Masking)
def main(frames, given, camera, *, settings, progress):
    from surgisim.perception.masking.outline import masks

    return masks(frames, given, camera, settings, progress=progress)


if __name__ == "__main__":
    main()
