"""Draw recordings that conceal nothing from the model that a diagnosis has of a recording.

reads   a recording folder
writes  draws.npz    moved (N, K, T, 3) [m] from rest (K, 3) [m], of the recording's points kept (K,)
"""

from surgisim.config.draws import Draws
from surgisim.stage import Bytes, Source, stage


@stage(
    reads={
        "recording": Source("a recording folder"),
        "work": Source("a folder that keeps finished runs, so that a second start goes on", required=False),
    },
    writes={"draws": Bytes(".npz")},
    settings=Draws,
)
def main(recording, work, *, settings, progress):
    import io

    import numpy as np

    from surgisim.diagnosis.clip import clip_of
    from surgisim.diagnosis.diagnose import prepare_case
    from surgisim.diagnosis.files import memo_for
    from surgisim.proof.self_consistency import draws, draws_of_the_diagnosis
    from surgisim.recordings.folder import read_recording

    own, chosen = read_recording(recording), settings.diagnosis
    clip = clip_of(own, share=chosen.grid, device=chosen.device)
    case = prepare_case(clip, chosen, memo_for(recording, chosen, work), progress)
    moved = draws(case, settings.count, settings.seed, draws_of_the_diagnosis())
    stream = io.BytesIO()
    np.savez(stream, moved=moved, rest=clip.rest, kept=clip.kept)
    return stream.getvalue()


if __name__ == "__main__":
    main()
