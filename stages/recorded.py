"""Put a clip that went through the graph into a recording folder, for the diagnosis.

reads   body.npz, material.npz, physics.json, tracks.npz, motion.npz, frames.npz, camera.json, doubts.npz, fit.json
writes  recording.json, rest.ply, fixed.json, grip.npz, tracks.npz, split.json
"""

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.doubts import Doubts
from surgisim.artifacts.fit import Fit
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.material import Material
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.physics import Physics
from surgisim.artifacts.tracks import Tracks
from surgisim.config.recorded import Recorded
from surgisim.stage import Bytes, stage

FILES = {"recording": ".json", "rest": ".ply", "fixed": ".json", "grip": ".npz", "points": ".npz", "split": ".json"}
READS = {
    "body": Body,
    "material": Material,
    "physics": Physics,
    "tracks": Tracks,
    "motion": Motion,
    "frames": Frames,
    "camera": Camera,
    "doubts": Doubts,
    "fit": Fit,
}


@stage(reads=READS, writes={name: Bytes(suffix) for name, suffix in FILES.items()}, settings=Recorded)
def main(*, settings, progress, **clip):
    from surgisim.recordings.folder import encoded_recording
    from surgisim.recordings.of_clip import recording_of

    files = encoded_recording(recording_of(settings.name, **clip))
    names = (f"{'tracks' if name == 'points' else name}{suffix}" for name, suffix in FILES.items())
    return tuple(files[name] for name in names)


if __name__ == "__main__":
    main()
