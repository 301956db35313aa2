"""Headless Chromium through ChromeDriver's own HTTP interface (W3C WebDriver): nothing to install but the two."""

import base64
import json
import re
import shutil
import subprocess
import tempfile
import urllib.request
from types import TracebackType
from typing import Any

FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
)
WEBGL = "--enable-unsafe-swiftshader", "--use-angle=swiftshader"


def installed() -> bool:
    return all(shutil.which(name) for name in ("chromium", "chromedriver"))


class Browser:
    """One window; close it by leaving the `with` block."""

    def __init__(self, width: int = 1280, height: int = 900, *, webgl: bool = False) -> None:
        """webgl: whether pages may draw in 3D, which is slow without a GPU."""
        self.profile = tempfile.TemporaryDirectory()
        self.driver = subprocess.Popen(
            ["chromedriver", "--port=0"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        line = next(line for line in self.driver.stdout if "started successfully" in line)
        port = re.search(r"port (\d+)", line).group(1)
        self.place = f"http://127.0.0.1:{port}/session"
        options = {
            "binary": shutil.which("chromium"),
            "args": [
                *FLAGS,
                *(WEBGL if webgl else ()),
                f"--user-data-dir={self.profile.name}",
                f"--window-size={width},{height}",
            ],
        }
        wanted = {"browserName": "chrome", "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}
        answer = self._call("POST", "", {"capabilities": {"alwaysMatch": wanted}})
        self.place += f"/{answer['sessionId']}"

    def __enter__(self) -> "Browser":
        return self

    def __exit__(self, _kind: type | None, _error: BaseException | None, _trace: TracebackType | None) -> None:
        self._call("DELETE", "")
        self.driver.terminate()
        self.driver.wait(10)
        self.profile.cleanup()

    def open(self, address: str) -> None:
        self._call("POST", "/url", {"url": address})

    def run(self, script: str) -> Any:
        """What the body of an async function returns in the page."""
        wrapped = f"const done = arguments[0]; (async () => {{ {script} }})().then(done, e => done('failed: ' + e))"
        return self._call("POST", "/execute/async", {"script": wrapped, "args": []})

    def log(self) -> list[str]:
        """Console messages since the last call."""
        return [entry["message"] for entry in self._call("POST", "/se/log", {"type": "browser"})]

    def resize(self, width: int, height: int) -> None:
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        command = {"cmd": "Emulation.setDeviceMetricsOverride", "params": metrics}
        self._call("POST", "/goog/cdp/execute", command)

    def press(self, words: str) -> None:
        """Click on the button, tab or other piece of the page that shows just these words."""
        script = """
            for (let n = 0; n < 50; n++) {
                const all = [...document.querySelectorAll('button, [role=tab], label, a')];
                const one = all.find(e => e.textContent.trim() === WORDS);
                if (one) {
                    one.scrollIntoView({block: 'center'});
                    const box = one.getBoundingClientRect();
                    return [box.x + box.width / 2, box.y + box.height / 2];
                }
                await new Promise(later => setTimeout(later, 100));
            }
            return null"""
        found = self.run(script.replace("WORDS", json.dumps(words)))
        assert isinstance(found, list), f"the page has nothing to press that says {words!r}"
        self.drag(tuple(found))

    def drag(self, *points: tuple[float, float], pause: int = 60) -> None:
        """Press the mouse at the first point [px], move over the others, let go at the last; one point is a click."""

        def to(point: tuple[float, float]) -> dict:
            x, y = map(round, point)
            return {"type": "pointerMove", "duration": pause, "x": x, "y": y, "origin": "viewport"}

        first, *others = points
        held = [{"type": "pause", "duration": pause}, *map(to, others)]
        moves = [to(first), {"type": "pointerDown", "button": 0}, *held, {"type": "pointerUp", "button": 0}]
        mouse = {"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": moves}
        self._call("POST", "/actions", {"actions": [mouse]})

    def screenshot(self) -> bytes:
        """What the window shows, as PNG."""
        return base64.b64decode(self._call("GET", "/screenshot"))

    def printed(self) -> bytes:
        """The page as PDF."""
        return base64.b64decode(self._call("POST", "/print", {}))

    def _call(self, method: str, path: str, body: dict | None = None) -> Any:
        content = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(
            self.place + path, content, {"Content-Type": "application/json"}, method=method
        )
        with urllib.request.urlopen(request, timeout=120) as answer:
            return json.loads(answer.read())["value"]
