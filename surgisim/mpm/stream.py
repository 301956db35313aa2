"""A stream of its own for each body on a GPU: runs that several threads begin there overlap.

A small body leaves most of a GPU idle, so eight at once take hardly longer than one. Warp's current stream belongs to
the process, and a graph must not be captured while another thread gives commands, so threads give theirs in turn; they
wait for what they began outside their turn.
"""

import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from threading import RLock

import warp as wp

COMMANDS = RLock()
LOOK = 2e-4
"""How often a thread looks whether its work is done [s]."""


class Stream:
    """Where a body's work is done, one piece after the other; on a CPU, at once."""

    def __init__(self, device: str) -> None:
        self._where = wp.get_device(device)
        if self.later:
            self._own, self._memory = wp.Stream(self._where), Reused(self._where.get_allocator())

    @property
    def later(self) -> bool:
        """Whether work goes on after it was asked for."""
        return self._where.is_cuda

    @contextmanager
    def turn(self) -> Iterator[None]:
        """The only thread that gives commands, all of them to this stream, its arrays from this stream's memory."""
        if not self.later:
            yield
            return
        with (
            COMMANDS,
            wp.ScopedStream(self._own, sync_enter=False),
            wp.ScopedAllocator(self._where, self._memory),
        ):
            yield

    def wait(self) -> None:
        """Until all that was asked for is done."""
        while self.later:
            with COMMANDS:
                if self._own.is_complete:
                    return
            time.sleep(LOOK)


class Reused:
    """Memory that a stream keeps for its next arrays.

    CUDA's own free belongs to all streams: it waits for each of them, and it spoils a graph that another thread
    captures meanwhile, as Python drops arrays whenever it likes. Blocks are powers of two of bytes.
    """

    deallocate_requires_context_guard = False
    """Asked by Warp: keeping a block is no command to the device."""

    def __init__(self, source) -> None:
        """source: Warp's allocator, which gives the blocks and takes them back in the end."""
        self._source, self._free = source, defaultdict(list)

    def allocate(self, size: int) -> int:
        """Address of at least `size` bytes."""
        block = _block(size)
        try:
            return self._free[block].pop()
        except IndexError:
            return self._source.allocate(block)

    def deallocate(self, address: int, size: int) -> None:
        """Keep what `allocate(size)` gave for the next of its size."""
        self._free[_block(size)].append(address)

    def __del__(self) -> None:
        # Arrays refer to where they come from: none is left.
        with COMMANDS:
            for block, addresses in self._free.items():
                for address in addresses:
                    self._source.deallocate(address, block)


def _block(size: int) -> int:
    return 1 << (size - 1).bit_length()
