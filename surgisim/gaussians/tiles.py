"""Which ellipses each tile of the image holds, nearest first.

Gaussians are sorted by depth once and then dealt to the tiles in that order, so every list is sorted and ties
keep the order of the Gaussians. Cheaper than sorting (tile, depth) pairs, with the same outcome.
"""

import numpy as np
from numba import njit

from surgisim.problem import Problem

TILE = 16
"""Side of a tile [px]."""
MOST_ENTRIES = 30_000_000
"""More (Gaussian, tile) pairs than this would need over 1.5 GB."""


def deal(depth: np.ndarray, box: np.ndarray, width: int, height: int) -> tuple[np.ndarray, ...]:
    """Lists of all tiles laid end to end.

    Returns where each tile's list starts, (tiles + 1,); the Gaussian of each entry, (E,); the entry's number
    in the order of the Gaussians, (E,); and where each Gaussian's numbers start, (G + 1,).
    """
    first = _count(box)
    if first[-1] > MOST_ENTRIES:
        raise Problem(
            f"rasterise: {len(box)} Gaussians cover {first[-1]} tiles, and at most {MOST_ENTRIES} fit in memory. "
            "Their radii are too large for this image; limit or prune them."
        )
    order = depth_order(depth, first)
    return *_deal(order, box, first, -(-width // TILE), -(-height // TILE)), first


@njit(cache=True)
def _count(box):
    """Running number of tiles that the Gaussians touch, (G + 1,) int64."""
    first = np.zeros(len(box) + 1, np.int64)
    for g in range(len(box)):
        n = 0
        if box[g, 1] > box[g, 0]:
            n = ((box[g, 1] - 1) // TILE - box[g, 0] // TILE + 1) * ((box[g, 3] - 1) // TILE - box[g, 2] // TILE + 1)
        first[g + 1] = first[g] + n
    return first


@njit(cache=True)
def depth_order(depth, first):
    """Gaussians in view from near to far, ties in their own order: a radix sort of the float's bits, 11 a pass."""
    bits = depth.view(np.uint32)
    order = np.empty(len(depth), np.int32)
    n = 0
    for g in range(len(depth)):
        if first[g + 1] > first[g]:
            order[n] = g
            n += 1
    order = order[:n]
    other = np.empty(n, np.int32)
    for shift in (0, 11, 22):
        start = np.zeros(2049, np.int64)
        for g in order:
            start[((bits[g] >> np.uint32(shift)) & np.uint32(2047)) + 1] += 1
        for b in range(2048):
            start[b + 1] += start[b]
        for g in order:
            b = (bits[g] >> np.uint32(shift)) & np.uint32(2047)
            other[start[b]] = g
            start[b] += 1
        order, other = other, order
    return order


@njit(cache=True)
def _deal(order, box, first, across, down):
    start = np.zeros(across * down + 1, np.int64)
    for g in order:
        for ty in range(box[g, 2] // TILE, (box[g, 3] - 1) // TILE + 1):
            for tx in range(box[g, 0] // TILE, (box[g, 1] - 1) // TILE + 1):
                start[ty * across + tx + 1] += 1
    for t in range(across * down):
        start[t + 1] += start[t]
    place = start[:-1].copy()
    gaussian = np.empty(first[-1], np.int32)
    number = np.empty(first[-1], np.int32)
    for g in order:
        n = first[g]
        for ty in range(box[g, 2] // TILE, (box[g, 3] - 1) // TILE + 1):
            for tx in range(box[g, 0] // TILE, (box[g, 1] - 1) // TILE + 1):
                t = ty * across + tx
                gaussian[place[t]] = g
                number[place[t]] = n
                place[t] += 1
                n += 1
    return start, gaussian, number
