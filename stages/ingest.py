"""Read a recording and bring it to its working size.

reads   a video (mp4, avi, mkv), a folder of images, or an EndoNeRF folder, zip, or folder of zips
writes  frames.npz  Frames   camera.json  Camera   given.npz  Given
"""

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.config.ingest import Ingest
from surgisim.stage import Source, stage


@stage(
    reads={"clip": Source("a video, a folder of images, or an EndoNeRF folder, zip, or folder of zips")},
    writes={"frames": Frames, "camera": Camera, "given": Given},
    settings=Ingest,
)
def main(clip, *, settings, progress):
    from surgisim.perception.ingest.clip import ingest

    return ingest(clip, settings, progress=progress)


if __name__ == "__main__":
    main()
