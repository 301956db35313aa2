"""Recorded launches, step after step; those of one phase at once."""

import threading

import warp as wp

Phases = list[list[wp.Launch]]
"""Phases in order; the launches of one phase do not touch each other's sums."""


def march(phases: Phases, steps: int) -> None:
    """Launch every phase `steps` times over.

    A second launch of a phase runs on a thread of its own: a launch on the CPU releases the interpreter's lock.
    """
    crew = [_Hand() for _ in range(max(map(len, phases)) - 1)]
    try:
        for _ in range(steps):
            for phase in phases:
                for hand, launch in zip(crew, phase[1:], strict=False):
                    hand.take(launch)
                phase[0].launch()
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
