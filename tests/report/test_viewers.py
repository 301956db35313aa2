"""Scene, body and the last frame of a replay open in viewers that nobody here wrote."""

import functools
import http.server
import io
import shutil
import subprocess
import threading
import time
from pathlib import Path

import browser
import numpy as np
import pytest
from PIL import Image
from slab import slab

from surgisim.artifacts.replay import Replay
from surgisim.artifacts.scene import Scene
from surgisim.simulation.outputs import final_ply
from surgisim.thickening import mesh, points

PACKAGES = "@mkkellogg/gaussian-splats-3d@0.4.7", "three@0.180.0"
PAGE = """<!doctype html><style>html, body { margin: 0; height: 100%; background: #000 }</style>
<link rel="icon" href="data:,">
<script type="importmap">{"imports": {"three": "/node_modules/three/build/three.module.js"}}</script>
<script type="module">
import * as Splats from "/node_modules/@mkkellogg/gaussian-splats-3d/build/gaussian-splats-3d.module.js";
// Metres are drawn as centimetres: the viewer draws nothing within a tenth of a unit.
const viewer = new Splats.Viewer({
  cameraUp: [0, -1, 0], initialCameraPosition: [0, 0, 0], initialCameraLookAt: [0, 0, 6],
  useBuiltInControls: false,
  sharedMemoryForWorkers: false, gpuAcceleratedSort: false, sceneRevealMode: Splats.SceneRevealMode.Instant,
});
const file = new URLSearchParams(location.search).get("file");
viewer.addSplatScene(file, { showLoadingUI: false, progressiveLoad: false, scale: [100, 100, 100] }).then(
  () => { viewer.start(); window.shown = viewer.getSplatMesh().getSplatCount() },
  problem => { window.shown = `${problem}` });
</script>
"""


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> dict[str, tuple[Path, int]]:
    """Name -> file and how many splats it holds, all of a red slab 6 cm away."""
    body, folder = slab(), tmp_path_factory.mktemp("viewers")
    top = body.rest[body.surface]
    count = len(top)
    red = np.tile([0.9, 0.1, 0.1], (count, 1))
    radius, upright = np.full((count, 3), np.log(0.0016)), np.tile([1.0, 0, 0, 0], (count, 1))
    scene = Scene(top, np.full(count, 4.0), radius, upright, red)
    still = np.stack([body.rest, body.rest])
    empty = np.zeros((2, 1, 3))
    replay = Replay(
        np.arange(2.0),
        still,
        empty,
        np.zeros(3),
        np.ones(3, int),
        1.0,
        np.ones(2),
        empty[:, 0, :2],
        np.zeros((0, 1, 1, 3)),
    )
    made = {"scene": scene.encode({}), "body": points(body), "final": final_ply(replay, body)}
    for name, content in made.items():
        (folder / f"{name}.ply").write_bytes(content)
    counts = {"scene": count, "body": len(body.rest), "final": len(body.rest)}
    return {name: (folder / f"{name}.ply", counts[name]) for name in made}


@pytest.fixture(scope="module")
def server(files):
    """Address of a folder with the page, the viewer and the files."""
    if not browser.installed() or shutil.which("npm") is None:
        pytest.skip("NO BROWSER OR NO NPM: nobody looked at the splats in a viewer.")
    folder = files["scene"][0].parent
    (folder / "index.html").write_text(PAGE)
    install = ["npm", "install", "--no-audit", "--no-fund", "--prefix", str(folder), *PACKAGES]
    done = subprocess.run(install, capture_output=True, text=True, timeout=300)
    if done.returncode:
        pytest.skip(f"NO VIEWER: npm could not install it ({done.stderr.strip().splitlines()[:1]}).")

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_):
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(folder))) as there:
        threading.Thread(target=there.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{there.server_port}"
        there.shutdown()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["scene", "body", "final"])
def test_a_browsers_splat_viewer_shows_the_tissue(server, files, name):
    with browser.Browser(640, 520, webgl=True) as window:
        window.open(f"{server}/index.html?file={name}.ply")
        begun, shown, red = time.monotonic(), None, 0.0
        # A picture takes seconds without a GPU.
        while red < 0.1 and time.monotonic() - begun < 90:
            time.sleep(1)
            shown = window.run("return window.shown ?? null")
            assert shown is None or isinstance(shown, int), shown
            picture = np.asarray(Image.open(io.BytesIO(window.screenshot())).convert("RGB")).astype(int)
            red = float((picture[..., 0] > picture[..., 2] + 60).mean())
        assert shown == files[name][1]
        assert red > 0.1
        middle = picture[len(picture) // 2, picture.shape[1] // 2]
        assert middle[0] > middle[2] + 60


@pytest.mark.parametrize("name", ["scene", "body", "final"])
def test_open3d_reads_them(files, name):
    open3d = pytest.importorskip("open3d", reason="NO OPEN3D: nobody opened the files in it.", exc_type=ImportError)
    file, count = files[name]
    cloud = open3d.io.read_point_cloud(str(file))
    assert len(cloud.points) == count
    assert np.asarray(cloud.points)[:, 2].min() == pytest.approx(0.06, abs=0.003)
    assert cloud.has_colors() == (name != "scene")
    splats = open3d.t.io.read_point_cloud(str(file)).point
    assert {"opacity", "scale", "rot", "f_dc"} <= set(splats)


def test_open3d_finds_the_bodys_mesh_watertight(tmp_path):
    open3d = pytest.importorskip("open3d", reason="NO OPEN3D: nobody opened the mesh in it.", exc_type=ImportError)
    (tmp_path / "mesh.ply").write_bytes(mesh(slab()))
    found = open3d.io.read_triangle_mesh(str(tmp_path / "mesh.ply"))
    assert found.is_watertight()
    assert found.has_vertex_colors()
    assert found.get_volume() == pytest.approx(slab().volume.sum(), rel=0.03)
