"""Recorded launches, step after step; those of one phase at once."""

import threading

import warp as wp

from surgisim.side_by_side import threads

GRAPH = 64
"""Steps that a CUDA graph holds at most: enough that starting it costs nothing."""


Phases = list[list[wp.Launch]]
"""Phases in order; the launches of one phase do not touch each other's sums."""


class March:
    """The phases of a step."""

    def __init__(self, phases: Phases, device: str) -> None:
        self.phases, self.device = phases, device
        self._graphs: dict[int, wp.Graph] | None = {} if wp.get_device(device).is_cuda else None

    def march(self, steps: int) -> None:
        """Launch every phase `steps` times over."""
        if self._graphs is None:
            _launched(self.phases, steps)
            return
        for length, times in ((GRAPH, steps // GRAPH), (steps % GRAPH, 1)):
            if length and times:
                graph = self._graph(length)
                for _ in range(times):
                    wp.capture_launch(graph)

    def _graph(self, steps: int) -> wp.Graph:
        """A CUDA graph of that many steps: the clock is on the device, so that it serves wherever it begins."""
        if steps not in self._graphs:
            with wp.ScopedCapture(self.device, force_module_load=False) as capture:
                for _ in range(steps):
                    for phase in self.phases:
                        for launch in phase:
                            launch.launch()
            self._graphs[steps] = capture.graph
        return self._graphs[steps]


def _launched(phases: Phases, steps: int) -> None:
    """On a CPU: a second launch of a phase runs on a thread of its own, as a launch releases the interpreter's lock.

    A process that has one processor to itself launches them one after the other: handing over would have to wait until
    the one that others keep busy is free.
    """
    crew = [_Hand() for _ in range(min(max(map(len, phases)), threads()) - 1)]
    try:
        for _ in range(steps):
            for phase in phases:
                for hand, launch in zip(crew, phase[1:], strict=False):
                    hand.take(launch)
                phase[0].launch()
                for launch in phase[1 + len(crew) :]:
                    launch.launch()
                for hand, _launch in zip(crew, phase[1:], strict=False):
                    hand.wait()
    finally:
        for hand in crew:
            hand.leave()


class _Hand:
    """A thread that launches what it is given."""

    def __init__(self) -> None:
        self._given, self._done, self._launch = threading.Lock(), threading.Lock(), None
        self._given.acquire()
        self._done.acquire()
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def take(self, launch: wp.Launch) -> None:
        self._launch = launch
        self._given.release()

    def wait(self) -> None:
        self._done.acquire()

    def leave(self) -> None:
        self._launch = None
        self._given.release()
        self._thread.join()

    def _work(self) -> None:
        while True:
            self._given.acquire()
            if self._launch is None:
                return
            self._launch.launch()
            self._done.release()
