"""Marking by hand, in a browser: what is instrument, what is tissue, and what the instrument holds.

Every place that goes to the page or comes from it is in the recording's own pixels.
"""

import http.server
import json
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from pydantic import TypeAdapter, ValidationError

from surgisim.artifacts.base import save_bytes
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.given import Given
from surgisim.config.ingest import Ingest
from surgisim.config.masking import Click, Masking
from surgisim.config.tracking import Grasp
from surgisim.perception.ingest.clip import ingest
from surgisim.perception.masking.outline import masks
from surgisim.problem import Problem
from surgisim.viewer.gate import Gate, local

LARGE = 960
"""Longest side of the pictures that are marked [px]."""
BESIDE = 4
"""Frames before and after the one that is shown, among which its mask is looked for."""
LONGEST = 1 << 20
"""Longest answer of the page that is read [bytes]."""
COLOUR = (40, 200, 255)


@dataclass(frozen=True)
class Marks:
    """What somebody marked."""

    clicks: list[Click]
    grasps: list[Grasp]

    @classmethod
    def parsed(cls, raw: Mapping[str, Any]) -> "Marks":
        """Raises ValidationError where a mark lacks something or has a wrong type."""
        return cls(
            TypeAdapter(list[Click]).validate_python(raw.get("clicks", [])),
            TypeAdapter(list[Grasp]).validate_python(raw.get("grasps", [])),
        )


class Picking:
    """One clip, opened to be marked."""

    def __init__(
        self, clip: Path, out: Path, reading: Ingest, masking: Masking, *, progress: Callable[[float, float, str], None]
    ) -> None:
        """out: folder of the two JSON files. Raises Problem where the clip cannot be read."""
        self.clip, self.out, self.masking = clip, out, masking
        large = reading.model_copy(update={"size": max(reading.size, LARGE)})
        self.large, self.camera, _ = ingest(clip, large, progress=progress)
        self.frames, self.working, self.given = self._working(reading.size)
        self.saved: tuple[Path, Path] | None = None

    def _working(self, size: int) -> tuple[Frames, Camera, Given]:
        """The clip at its working size, and as if no masks had come with it: they are being marked."""
        camera = self.camera
        share = min(1.0, size / max(camera.width, camera.height))
        wide, high = max(1, round(camera.width * share)), max(1, round(camera.height * share))
        rgb = np.stack([cv2.resize(f, (wide, high), interpolation=cv2.INTER_AREA) for f in self.large.rgb])
        plain = {"fx": camera.fx * share, "fy": camera.fy * share, "cx": (wide - 1) / 2, "cy": (high - 1) / 2}
        kept = "fps", "frames", "scale", "focal_from", "source", "source_size", "crop"
        told = {name: getattr(camera, name) for name in kept}
        size = (0, high, wide)
        none = Given(np.zeros(size, bool), np.zeros(size, np.float32), np.zeros((*size, 3), np.uint8), 0.0)
        return Frames(rgb, self.large.split), Camera(wide, high, **plain, **told), none

    def about(self) -> dict[str, Any]:
        """What the page has to know."""
        left, top, width, height = self.camera.crop
        fps, count = self.camera.fps, self.camera.frames
        return {"name": self.clip.name, "crop": [left, top, width, height], "fps": fps, "frames": count}

    def picture(self, frame: int) -> bytes:
        """One frame as JPEG, of what the crop keeps."""
        return cv2.imencode(".jpg", self.large.rgb[frame][..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 92])[1].tobytes()

    def mask(self, frame: int, marks: Marks) -> bytes:
        """The instrument in one frame as these clicks have it: PNG, see-through elsewhere.

        It is looked for among the frames beside that one and those that were clicked in, as a run does among all.
        """
        near = set(range(max(0, frame - BESIDE), min(len(self.frames.rgb), frame + BESIDE + 1)))
        among = sorted(near | {c.frame for c in marks.clicks if c.frame < len(self.frames.rgb)})
        clicks = [c.model_copy(update={"frame": among.index(c.frame)}) for c in marks.clicks if c.frame in among]
        few = Frames(self.frames.rgb[among], self.frames.split[among])
        camera = Camera(**{**vars(self.working), "frames": len(among)})
        found = masks(few, self.given, camera, self.masking.model_copy(update={"clicks": clicks}), progress=_quiet)
        tool = found.tool[among.index(frame)]
        overlay = np.zeros((*tool.shape, 4), np.uint8)
        overlay[tool] = (*COLOUR[::-1], 130)
        edge = tool & ~cv2.erode(tool.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
        overlay[edge] = (*COLOUR[::-1], 255)
        return cv2.imencode(".png", overlay)[1].tobytes()

    def save(self, marks: Marks) -> dict[str, Any]:
        """Write both files whole, or neither, and say how they are used."""
        self.out.mkdir(parents=True, exist_ok=True)
        stem = self.clip.stem or self.clip.name
        clicks, grasp = self.out / f"{stem}.clicks.json", self.out / f"{stem}.grasp.json"
        held = [g.model_dump(mode="json", exclude_none=True) for g in marks.grasps]
        save_bytes({clicks: _json([c.model_dump(mode="json") for c in marks.clicks]), grasp: _json(held)})
        self.saved = clicks, grasp
        told = [f"--clicks {clicks}"] * bool(marks.clicks) + [f"--grasp {grasp}"] * bool(marks.grasps)
        return {"files": [str(clicks), str(grasp)], "command": " ".join(["surgisim run", str(self.clip), *told])}


class PickPage:
    """The page and what it asks for, behind the gate."""

    def __init__(self, picking: Picking, *, host: str = "localhost", port: int = 0, token: str | None = None) -> None:
        self.picking, self.turn = picking, threading.Lock()
        page = self

        class Answer(http.server.BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                page.answer(self, None)

            def do_POST(self) -> None:
                length = int(self.headers.get("Content-Length", 0))
                page.answer(self, self.rfile.read(length) if length <= LONGEST else b"")

            def log_message(self, *_: object) -> None:
                return

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Answer)
        self.gate = Gate(host, port, self.server.server_port, token)
        self.thread = threading.Thread(target=self.server.serve_forever, daemon=True)
        self.thread.start()
        name = "localhost" if local(host) else host
        self.address = f"http://{name}:{self.gate.port}/" + (f"?token={token}" if token else "")

    def answer(self, request: http.server.BaseHTTPRequestHandler, body: bytes | None) -> None:
        try:
            kind, content = self._content(request.path, body)
            status = 200
        except ValidationError as error:
            words = "; ".join(f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors())
            kind, content, status = "text/plain; charset=utf-8", words.encode(), 400
        except (Problem, ValueError, LookupError) as error:
            kind, content, status = "text/plain; charset=utf-8", str(error).encode(), 400
        request.send_response(status)
        request.send_header("Content-Type", kind)
        request.send_header("Content-Length", str(len(content)))
        request.end_headers()
        request.wfile.write(content)

    def _content(self, path: str, body: bytes | None) -> tuple[str, bytes]:
        if body is None:
            if path == "/":
                return "text/html; charset=utf-8", files("surgisim.viewer").joinpath("pick.html").read_bytes()
            if path == "/about":
                return "application/json", _json(self.picking.about())
            return "image/jpeg", self.picking.picture(int(path.removeprefix("/frame/")))
        raw = json.loads(body)
        marks = Marks.parsed(raw)
        if path == "/mask":
            # One at a time: each takes all processors.
            with self.turn:
                return "image/png", self.picking.mask(int(raw["frame"]), marks)
        if path == "/save":
            return "application/json", _json(self.picking.save(marks))
        raise LookupError(f"{path}: nothing is asked for there.")

    def serve(self) -> None:
        """Wait for the thread that answers."""
        self.thread.join()

    def close(self) -> None:
        self.gate.close()
        self.server.shutdown()


def _quiet(_done: float, _total: float, _text: str = "") -> None:
    return


def _json(content: Any) -> bytes:
    return (json.dumps(content, indent=1) + "\n").encode()
