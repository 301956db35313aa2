"""Make the page of a preference study: which of several simulations looks most real.

reads   films of replays, and the recordings' frames and cameras
writes  study.html       what participants open; it says nowhere what a film shows
        study_key.json   what each film shows, for `python -m surgisim.proof.preferences`
"""

from surgisim.artifacts.camera import Camera
from surgisim.artifacts.frames import Frames
from surgisim.config.study import Study
from surgisim.stage import Bytes, Several, Source, stage


@stage(
    reads={
        "films": Several(Source("a replay's film")),
        "frames": Several(Frames),
        "cameras": Several(Camera),
    },
    writes={"page": Bytes(".html"), "key": Bytes(".json")},
    settings=Study,
)
def main(films, frames, cameras, *, settings, progress):
    import json

    from surgisim.proof.study import study
    from surgisim.report.page import template

    shown = {pair: film.read_bytes() for pair, film in zip(settings.films, films, strict=True)}
    clips = zip(settings.clips, frames, cameras, strict=True)
    page, key = study(shown, {clip: (f.rgb, camera.fps) for clip, f, camera in clips}, settings.seed)
    html = template("study.html.j2").render(told=page)
    return html.encode(), (json.dumps(key, indent=1) + "\n").encode()


if __name__ == "__main__":
    main()
