"""The viewer: scene, body and replay in a browser, and the body to be taken hold of.

Callbacks of the page only put what is wanted into a queue; one loop does it, so that nothing is touched by two threads.
"""

import contextlib
import io
import json
import queue
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np
import viser

from surgisim.artifacts.base import save_bytes
from surgisim.gaussians.attributes import drawn
from surgisim.mpm.cut import Cut
from surgisim.problem import Problem
from surgisim.viewer.carried import SCALE, Follower, FollowerOnDevice, GridNodes, Reconstructed, Shown
from surgisim.viewer.case import Case
from surgisim.viewer.gate import Gate, local
from surgisim.viewer.manipulation import Grasp, Manipulation, default_radius, under
from surgisim.viewer.words import about, parameters

LAYERS = ("splats", "surface", "particles")
TISSUE, HELD, GRIPPED, LINE = (214, 138, 122), (70, 120, 220), (245, 170, 40), (20, 20, 20)
PICTURE = 320
"""Width of the pictures beside the scene [px]."""
CUT_DEPTH = 2.0
"""Depth of a cut unless chosen otherwise [grid spacing]."""


class Viewer:
    """A page for one clip and variant; `serve` keeps it going."""

    def __init__(
        self,
        case: Case,
        out: Path,
        *,
        host: str = "localhost",
        port: int = 8080,
        token: str | None = None,
        device: str = "cpu",
    ) -> None:
        """out: where exported operations go. Raises Problem where host, port and token do not go together."""
        self.case, self.out, self.device = case, out, device
        # It says its own address, which is not the one to open.
        with contextlib.redirect_stdout(io.StringIO()):
            self.server = viser.ViserServer(
                host="127.0.0.1", port=0, label=f"{case.clip} · {case.variant}", verbose=False
            )
        self.gate = Gate(host, port, self.server.get_port(), token)
        shown_host = "localhost" if local(host) else host
        self.address = f"http://{shown_host}:{self.gate.port}/" + (f"?token={token}" if token else "")
        self.todo: queue.Queue[Callable[[], None]] = queue.Queue()
        self.over = threading.Event()
        self.tool: str | None = None
        self.grasps: list[Grasp] = []
        self.gizmos: list[viser.TransformControlsHandle] = []
        self.cut: Cut | None = None
        self._cut_from: np.ndarray | None = None
        self.hand: Manipulation | None = None
        self._followers: dict[int, Follower | FollowerOnDevice] = {}
        self.playing, self.running = False, False
        self._unshown: tuple[Follower | FollowerOnDevice, np.ndarray] | None = None
        self._spent: deque[float] = deque(maxlen=30)
        self._ahead = ThreadPoolExecutor(1)
        self._replay = Follower(case, GridNodes(case.replay.origin, case.replay.shape, case.replay.spacing))
        self._reconstructed = Reconstructed(case)
        self._middle = SCALE * np.array([0.0, 0.0, float(np.median(case.scene.mean[:, 2]))])
        self.size = SCALE * float(np.ptp(case.body.rest[:, :2], axis=0).max())
        self._draw_scene()
        self._draw_controls()
        self._show_frame(0)

    # What is drawn

    def _draw_scene(self) -> None:
        case, scene = self.case, self.server.scene
        scene.set_up_direction("-y")
        _, _, _, opacity, color = drawn(case.scene)
        still = np.zeros((self._replay.splats.matrix.shape[1], 3))
        rest = self._rest = self._replay.scene(still)
        self.splats = scene.add_gaussian_splats(
            "/splats", rest.center, rest.covariance, np.clip(color, 0, 1), np.clip(opacity, 0, 1)[:, None]
        )
        surface = self._replay.surface(still)
        self.surface = scene.add_mesh_simple(
            "/surface", surface, self._replay.faces, color=TISSUE, side="double", visible=False
        )
        cell = SCALE * float(np.cbrt(np.median(case.body.volume)))
        self.particles = scene.add_point_cloud(
            "/particles", SCALE * case.body.rest, case.body.color, point_size=0.8 * cell, visible=False
        )
        held = case.body.rest[case.material.held]
        self.held = scene.add_point_cloud("/held", SCALE * held, HELD, point_size=0.9 * cell, visible=False)
        gripped = np.zeros(len(case.body.rest), bool)
        for center, radius in zip(case.motion.center_rest, case.motion.radius, strict=True):
            gripped |= np.linalg.norm(case.body.rest - center, axis=1) <= radius
        self._gripped = gripped
        self.gripped = scene.add_point_cloud(
            "/gripped", SCALE * case.body.rest[gripped], GRIPPED, point_size=1.1 * cell, visible=False
        )

        @self.server.on_client_connect
        def _(client: viser.ClientHandle) -> None:
            camera = self.case.camera
            client.camera.position, client.camera.look_at = (0.0, 0.0, 0.0), tuple(self._middle)
            client.camera.up_direction = (0.0, -1.0, 0.0)
            client.camera.fov = 2 * float(np.arctan(camera.height / (2 * camera.fy)))

        @scene.on_click()
        def _(event: viser.SceneClickEvent) -> None:
            ray = np.array(event.ray_origin) / SCALE, np.array(event.ray_direction)
            self.todo.put(lambda: self._clicked(*ray))

    def _draw_controls(self) -> None:
        gui, case = self.server.gui, self.case
        gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
        gui.main_panel.dock_right()
        gui.add_markdown(about(case))
        self.layer = gui.add_dropdown("show", LAYERS)
        self.physics_on = gui.add_checkbox(
            "physics", True, hint="off: the scene as its own field moves it, or grips that carry only what they hold"
        )
        self.law = gui.add_dropdown("body", ("fitted", *(f"with {law}" for law in case.laws)))
        self.see_held = gui.add_checkbox("held tissue", False)
        self.see_gripped = gui.add_checkbox("tissue that the recording's instrument grips", False)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Recording"):
            self.moment = gui.add_slider("frame", 0, max(len(case.replay.time) - 1, 1), 1, 0)
            self.play = gui.add_button("Play")
            self.recorded = gui.add_image(self._small(case.frames.rgb[0]), label="recording", format="jpeg")
            blank = case.replay.rgb[0] if len(case.replay.rgb) else np.zeros_like(case.frames.rgb[0])
            self.replayed = gui.add_image(self._small(blank), label="replay", format="jpeg")
        with tabs.add_tab("By hand"):
            self.pull = gui.add_button("Pull", hint="then click on tissue, and drag the arrows")
            self.push = gui.add_button("Push", hint="then click on tissue: it is pressed away from you")
            self.two = gui.add_button("Two points", hint="then click on tissue twice")
            self.slit = gui.add_button("Cut", hint="then click on both ends of the cut")
            self.radius = gui.add_number(
                "radius of a grip [mm]", round(1e3 * default_radius(case), 2), min=0.1, step=0.1
            )
            self.depth = gui.add_number(
                "depth of a cut [mm]", round(1e3 * CUT_DEPTH * case.body.spacing, 2), min=0.1, step=0.1
            )
            self.start = gui.add_button("Start")
            self.let_go = gui.add_button("Release")
            self.sever = gui.add_button("Cut now")
            self.reset = gui.add_button("Back to rest")
            self.clear = gui.add_button("Remove grips and cut")
            self.export = gui.add_button("Export operation")
            self.paced = gui.add_markdown("")
            self.said = gui.add_markdown("Choose what to do, then click on the tissue.")
        with tabs.add_tab("Parameters"):
            gui.add_markdown(parameters(case))
        self._holding = True
        does = (
            (self.play, self._play), (self.start, self.begin), (self.let_go, self._release),
            (self.sever, self._sever), (self.reset, self._reset), (self.clear, self._clear),
            (self.export, self._export),
        )  # fmt: skip
        for button, act in does:
            self._wire(button.on_click, act)
        for button, tool in ((self.pull, "pull"), (self.push, "push"), (self.two, "two"), (self.slit, "cut")):
            self._wire(button.on_click, lambda tool=tool: self._choose(tool))
        self._wire(self.moment.on_update, lambda: self._show_frame(int(self.moment.value)))
        for control in (self.layer, self.see_held, self.see_gripped, self.physics_on):
            self._wire(control.on_update, self._show_layers)
        self._wire(self.law.on_update, self._stale)

    def _wire(self, register: Callable, does: Callable[[], None]) -> None:
        @register
        def _(_event: object) -> None:
            self.todo.put(does)

    def _small(self, rgb: np.ndarray) -> np.ndarray:
        return cv2.resize(rgb, (PICTURE, round(PICTURE * rgb.shape[0] / rgb.shape[1])), interpolation=cv2.INTER_AREA)

    def say(self, words: str) -> None:
        self.said.content = words

    # What is shown

    def _show_layers(self) -> None:
        self.splats.visible = self.layer.value == "splats"
        self.surface.visible = self.layer.value == "surface"
        self.particles.visible = self.layer.value == "particles"
        self.held.visible, self.gripped.visible = self.see_held.value, self.see_gripped.value
        if self.hand is None:
            self._show_frame(int(self.moment.value))
        else:
            self._show_state()

    def _put(self, shown: Shown) -> None:
        with self.server.atomic():
            self.splats.centers = shown.center
            self.splats.covariances = shown.covariance
        # Otherwise it waits for more to send, and frames are left out.
        self.server.flush()

    def _put_body(self, positions: np.ndarray) -> None:
        self.particles.points = (SCALE * positions).astype(np.float32)

    def _show_frame(self, t: int) -> None:
        """A moment of the recording: recording beside it, and the scene with physics or without."""
        if self.hand is not None:
            return
        case, replay = self.case, self.case.replay
        if t < len(case.frames.rgb):
            self.recorded.image = self._small(case.frames.rgb[t])
        if t < len(replay.rgb):
            self.replayed.image = self._small(replay.rgb[t])
        if self.physics_on.value:
            u = replay.nodes[t]
            if self.layer.value == "splats":
                self._put(self._replay.scene(u))
            elif self.layer.value == "surface":
                self.surface.vertices = self._replay.surface(u).astype(np.float32)
            else:
                self._put_body(replay.position[t])
        elif self.layer.value == "splats":
            self._put(self._reconstructed.scene(t / case.camera.fps))
        if self.see_gripped.value:
            self.gripped.points = (SCALE * replay.position[t][self._gripped]).astype(np.float32)

    def _show_state(self) -> None:
        """The body under the hand, as it is now."""
        hand = self.hand
        if not self.physics_on.value:
            self._put(self._without_physics(hand.offsets))
            return
        self._show_body(self._follower(), hand.state[0])

    def _show_body(self, follower: Follower | FollowerOnDevice, u: np.ndarray) -> None:
        """At displacements of its nodes [m], (A, 3)."""
        if self.layer.value == "splats":
            self._put(follower.scene(u))
        elif isinstance(follower, FollowerOnDevice):
            self.say("On a GPU only the splats follow. Show those.")
        elif self.layer.value == "surface":
            self.surface.vertices = follower.surface(u).astype(np.float32)
        else:
            self._put_body(follower.body(u))

    def _follower(self) -> Follower | FollowerOnDevice:
        simulator = self.hand.active
        if id(simulator) not in self._followers:
            kind = FollowerOnDevice if self.device == "cuda" else Follower
            self._followers[id(simulator)] = kind(self.case, simulator)
        return self._followers[id(simulator)]

    def _without_physics(self, offsets: np.ndarray) -> Shown:
        """Splats of which only those within a grip go along, rigidly."""
        scene = self.case.scene
        moved = np.zeros_like(scene.mean, dtype=float)
        for grasp, offset in zip(self.hand.grasps, offsets, strict=True):
            near = np.linalg.norm(scene.mean - np.array(grasp.center), axis=1) <= grasp.radius
            moved[near] += offset
        return Shown(self._rest.center + SCALE * moved, self._rest.covariance)

    # What is done

    def _play(self) -> None:
        if self.hand is not None:
            self._clear()
        self.playing = not self.playing
        self.play.label = "Pause" if self.playing else "Play"

    def _choose(self, tool: str) -> None:
        self.tool, self._cut_from = tool, None
        words = {"pull": "the tissue to take hold of", "push": "the tissue to press", "two": "the first of two points"}
        self.say(f"Click on {words.get(tool, 'where the cut begins')}.")

    def _clicked(self, origin: np.ndarray, direction: np.ndarray) -> None:
        if self.tool is None:
            return
        particle = under(self.case, origin, direction)
        if particle is None:
            self.say("There is no tissue. Click on the tissue.")
            return
        place = self.case.body.rest[particle].astype(float)
        if self.tool == "cut":
            self._place_cut(place)
            return
        away = np.asarray(direction, float) / np.linalg.norm(direction)
        self.add_grasp(place, 1e-3 * self.radius.value * away if self.tool == "push" else np.zeros(3))
        if self.tool == "two":
            self.tool = "pull"
            self.say("Click on the second point.")
            return
        self.tool = None
        self.say(f"{len(self.grasps)} placed. Start, and drag the arrows.")

    def add_grasp(self, place: np.ndarray, offset: np.ndarray) -> None:
        """A grip at a place at rest [m], (3,), that is wanted `offset` [m] from it."""
        self.grasps.append(Grasp(tuple(map(float, place)), 1e-3 * float(self.radius.value)))
        name = f"/grip{len(self.grasps)}"
        arrows = self.server.scene.add_transform_controls(
            name, scale=0.2 * self.size, disable_rotations=True, depth_test=False, position=SCALE * (place + offset)
        )
        self.gizmos.append(arrows)
        # Drawn in lines: splats behind a surface that lets light through are left out by the browser.
        ball = circles(SCALE * self.grasps[-1].radius)
        self.server.scene.add_line_segments(f"{name}/ball", ball, GRIPPED, line_width=2)
        self._stale()

    def _place_cut(self, place: np.ndarray) -> None:
        if self._cut_from is None:
            self._cut_from = place
            self.say("Click on where the cut ends.")
            return
        if np.linalg.norm(place - self._cut_from) < self.case.body.spacing:
            self.say("That is closer to its beginning than a grid cell. Click farther away.")
            return
        self.cut, self.tool = Cut(self._cut_from, place, 1e-3 * float(self.depth.value)), None
        ends = SCALE * np.array([[self.cut.begin, self.cut.end]])
        self.server.scene.add_line_segments("/cut", ends, LINE, line_width=5)
        self._stale()
        self.say("The cut is placed. Start, and then Cut now.")

    def _stale(self) -> None:
        """What was simulated does not fit what is placed now."""
        self.hand, self.running, self._followers, self._unshown = None, False, {}, None
        self.start.label = "Start"

    def begin(self) -> None:
        """Lay the body on its grid and take hold; pause where it goes, go on where it is paused."""
        if self.running:
            self.running, self.start.label = False, "Go on"
            self._show_state()
            return
        if self.hand is None:
            if not self.grasps and self.cut is None:
                self.say("Nothing is placed. Pull, push or cut first.")
                return
            self.say("Laying the body on its grid.")
            named = self.case.named if self.law.value != "fitted" else None
            self.hand = Manipulation(self.case, tuple(self.grasps), self.cut, physics=named, device=self.device)
            self._follower()
            self.say("Drag the arrows.")
        self.playing, self.running, self.start.label = False, True, "Pause"
        self._spent.clear()

    def _release(self) -> None:
        self._holding = False
        self.say("Let go.")

    def _sever(self) -> None:
        if self.hand is None:
            self.say("Start first.")
            return
        self.hand.sever()
        self._unshown = None
        self.say(f"Cut at {self.hand.cut_frame / self.case.camera.fps:.2f} s.")

    def _reset(self) -> None:
        self._holding, self.running, self.start.label = True, False, "Start"
        for grasp, gizmo in zip(self.grasps, self.gizmos, strict=True):
            gizmo.position = SCALE * np.array(grasp.center)
        if self.hand is not None:
            self.hand.reset()
            self._unshown = None
            self._show_state()

    def _clear(self) -> None:
        for k, gizmo in enumerate(self.gizmos):
            self.server.scene.remove_by_name(f"/grip{k + 1}/ball")
            gizmo.remove()
        if self.cut is not None:
            self.server.scene.remove_by_name("/cut")
        self.grasps, self.gizmos, self.cut, self._holding = [], [], None, True
        self._stale()
        self._show_frame(int(self.moment.value))

    def _export(self) -> None:
        if self.hand is None:
            self.say("Nothing was done yet. Place something, start, drag, and export then.")
            return
        raw = (json.dumps(self.hand.operation(), indent=1) + "\n").encode()
        folder = self.out / "operations"
        folder.mkdir(parents=True, exist_ok=True)
        number = 1 + sum(1 for _ in folder.glob(f"{self.case.clip}_*.json"))
        path = folder / f"{self.case.clip}_{number}.json"
        save_bytes({path: raw})
        self.server.send_file_download(path.name, raw)
        self.say(f"{path} repeats it: `surgisim run ... --operation {path}`")

    # The loop

    def step(self) -> None:
        """One frame by hand: grips toward where they were dragged, and the body after them.

        It is simulated while what was before is sent to the page.
        """
        hand = self.hand
        wanted = [np.array(g.position) / SCALE - c.center for g, c in zip(self.gizmos, hand.grasps, strict=True)]
        parts = hand.parts(np.array(wanted).reshape(-1, 3), np.full(len(hand.grasps), self._holding))
        for _ in range(hand.count):
            began = time.perf_counter()
            ahead = self._ahead.submit(next, parts, None)
            if self._unshown is not None and self.physics_on.value:
                self._show_body(*self._unshown)
            state = ahead.result()
            if state is None:
                break
            self._unshown = self._follower(), state[0]
            self._spent.append(time.perf_counter() - began)
        if not self.physics_on.value:
            self._show_state()
        if hand.frame % 10 == 0:
            gone = hand.frame / self.case.camera.fps
            self.paced.content = f"{gone:.2f} s of tissue's time, {self.rate:.1f} frames a second"

    @property
    def rate(self) -> float:
        """States of the body a second that are simulated and sent, of the last thirty."""
        return len(self._spent) / max(sum(self._spent), 1e-9)

    def serve(self) -> None:
        """Do what the page asks for until `over` is set."""
        while not self.over.is_set():
            idle = not (self.playing or self.running)
            try:
                wanted = self.todo.get(timeout=0.2) if idle else self.todo.get_nowait()
            except queue.Empty:
                wanted = None
            try:
                if wanted is not None:
                    wanted()
                elif self.running:
                    self._paced(self.step)
                elif self.playing:
                    self._paced(self._next_moment)
            except Problem as problem:
                self.running, self.playing, self.start.label = False, False, "Start"
                self.say(f"**{problem}**")

    def _next_moment(self) -> None:
        # The slider's own callback shows it.
        self.moment.value = (int(self.moment.value) + 1) % len(self.case.replay.time)

    def _paced(self, does: Callable[[], None]) -> None:
        """No faster than the tissue's own time."""
        began = time.perf_counter()
        does()
        time.sleep(max(0.0, 1 / self.case.camera.fps - (time.perf_counter() - began)))

    def close(self) -> None:
        self.over.set()
        self._ahead.shutdown()
        self.gate.close()
        with contextlib.redirect_stdout(io.StringIO()):
            self.server.stop()


def circles(radius: float, pieces: int = 48) -> np.ndarray:
    """Three circles around the origin, one across each axis, as segments (3 pieces, 2, 3)."""
    angle = np.linspace(0, 2 * np.pi, pieces + 1)
    flat = radius * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], 1)
    return np.concatenate([np.stack([ring[:-1], ring[1:]], 1) for ring in (np.roll(flat, k, 1) for k in range(3))])
