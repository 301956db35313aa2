"""What a grid's nodes weigh at points, handed on to the nodes that they follow."""

import numpy as np
from numba import njit
from scipy import sparse


def links_through(
    nodes: np.ndarray, weight: np.ndarray, gradient: np.ndarray, rule: sparse.csr_matrix
) -> tuple[np.ndarray, np.ndarray]:
    """Solid nodes (Q, L), in order, that carry points, with weight and its gradient [1, 1/m], (Q, L, 4).

    nodes, weight, gradient: as of `Grid.stencil`; rule: from solid nodes to those of the grid, (N, A). Rows shorter
    than the longest are padded with links of weight zero to their first node.
    """
    whole = rule.indptr, rule.indices, rule.data, rule.shape[1]
    index, link, length = _handed_on(nodes, weight, gradient, *whole)
    widest = max(1, int(length.max(initial=1)))
    return index[:, :widest], np.ascontiguousarray(link[:, :widest])


@njit(cache=True, nogil=True)
def _handed_on(nodes, weight, gradient, begin, column, share, count):
    """index (Q, L), link (Q, L, 4), and how many of each row count, (Q,)."""
    points = len(nodes)
    row, slot, length = np.full(count, -1), np.zeros(count, np.int64), np.zeros(points, np.int64)
    for p in range(points):
        for k in range(nodes.shape[1]):
            for e in range(begin[nodes[p, k]], begin[nodes[p, k] + 1]):
                if row[column[e]] != p:
                    row[column[e]] = p
                    length[p] += 1
    most = max(1, length.max()) if points else 1
    index, link = np.zeros((points, most), np.int32), np.zeros((points, most, 4))
    row[:] = -1
    found, sums = np.zeros(most, np.int64), np.zeros((most, 4))
    for p in range(points):
        n = 0
        for k in range(nodes.shape[1]):
            for e in range(begin[nodes[p, k]], begin[nodes[p, k] + 1]):
                a = column[e]
                if row[a] != p:
                    row[a], slot[a], found[n] = p, n, a
                    sums[n] = 0.0
                    n += 1
                sums[slot[a], 0] += weight[p, k] * share[e]
                for d in range(3):
                    sums[slot[a], 1 + d] += gradient[p, k, d] * share[e]
        kept = 0
        for a in np.sort(found[:n]):
            s = sums[slot[a]]
            # What weighs nothing there is no link.
            if s[0] != 0 or s[1] != 0 or s[2] != 0 or s[3] != 0:
                index[p, kept], link[p, kept] = a, s
                kept += 1
        index[p, kept:] = index[p, 0]
        length[p] = kept
    return index, link, length
