"""Give the seen surface depth: Algorithm 1 of the paper, and what its text asks for.

The paper scales positions by (rand + l) / 1000 < 1 toward the camera, which puts the copies in front of the surface.
Here material fills what lies behind the surface along the viewing rays, inside the bounding box up to 1.25 z_max, on a
lattice of the density the grid needs. The columns of the lattice run along z and each begins at the surface, so the top
layer follows it and every particle's volume is exact.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.ply import particles, write_ply
from surgisim.config.thickening import Thickening
from surgisim.gaussians.surface import Surface
from surgisim.problem import Problem
from surgisim.skin import normals, skin, width

LAYERS = 1000
"""Layers of the printed algorithm."""
FINE = 4
"""Samples of a column per particle while looking for where it enters the body."""


def thicken(
    surface: Surface,
    camera: Camera,
    settings: Thickening,
    *,
    centers: np.ndarray | None = None,
    progress: Callable[[float, float, str], None] = lambda done, total, text: None,
) -> Body:
    """The body behind a surface, as particles with volumes that sum to its own.

    surface: height map of the canonical scene; centers: the scene's Gaussians, camera frame [m], (G, 3), needed by the
    printed algorithm only. Raises Problem when nothing remains.
    """
    low, high = bounding_box(surface, camera)
    longest = float(max(high[:2] - low[:2]))
    spacing = longest / settings.cells
    if settings.method == "literal":
        body = _literal(surface, camera, settings, centers, low, high, spacing)
    else:
        body = _behind(surface, camera, settings, low, high, spacing)
        if len(body.rest) > settings.most_particles:
            spacing *= (len(body.rest) / settings.most_particles) ** (1 / 3) * 1.01
            progress(0.5, 1, f"{len(body.rest)} particles are too many; the grid is made coarser")
            body = _behind(surface, camera, settings, low, high, spacing)
    whole, pieces = largest_piece(body.rest, spacing)
    if pieces > 1:
        lost = len(whole) - int(whole.sum())
        progress(0.9, 1, f"dropped {pieces - 1} loose pieces ({lost} of {len(whole)} particles)")
    progress(1, 1, f"{int(whole.sum())} particles, grid spacing {1000 * spacing:.2f} mm")
    return Body(body.rest[whole], body.volume[whole], body.color[whole], body.surface[whole], body.held[whole], spacing)


def points(body: Body) -> bytes:
    """The body as coloured points or splats that any viewer opens: PLY with flags for surface and held particles."""
    columns = particles(body.rest, body.volume, body.color)
    columns |= {"surface": body.surface.astype(np.uint8), "held": body.held.astype(np.uint8)}
    return write_ply(columns, {"kind": "Points", "units": {"x": "m"}})


def mesh(body: Body) -> bytes:
    """The body's closed surface as a PLY of coloured triangles, which programs that mesh or print take: half a particle
    outside the outermost centres, so that it encloses the particles' volume."""
    corners, faces = np.unique(skin(body), return_inverse=True)
    faces = faces.reshape(-1, 3)
    centers = body.rest[corners].astype(float)
    out = normals(centers, faces)
    place = centers + 0.5 * width(body) * out
    columns = {name: place[:, k].astype(np.float32) for k, name in enumerate("xyz")}
    columns |= {f"n{name}": out[:, k].astype(np.float32) for k, name in enumerate("xyz")}
    rounded = np.rint(np.clip(body.color[corners], 0, 1) * 255).astype(np.uint8)
    columns |= {name: rounded[:, k] for k, name in enumerate(("red", "green", "blue"))}
    return write_ply(columns, {"kind": "Mesh", "units": {"x": "m"}}, faces)


def bounding_box(surface: Surface, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the box around the seen surface, camera frame [m], (3,) each; pixels count with their full width."""
    rows, columns = np.nonzero(surface.seen)
    z = surface.z[rows, columns]
    corners = [camera.lift(np.stack([columns + dx, rows + dy], -1), z) for dx in (-0.5, 0.5) for dy in (-0.5, 0.5)]
    return np.min(corners, (0, 1)), np.max(corners, (0, 1))


@dataclass(frozen=True)
class _Columns:
    """Lattice columns along z that meet the body."""

    xy: np.ndarray
    """Their place, camera frame [m], (N, 2)."""
    cell: np.ndarray
    """Row and column in the lattice, (N, 2) int."""
    begin: np.ndarray
    """Depth where they enter it [m], (N,)."""
    end: np.ndarray
    """Depth where they leave it [m], (N,)."""
    seen: np.ndarray
    """Whether they enter through the seen surface, not through the view's side, (N,) bool."""
    area: float
    """Cross-section of a column [m^2]."""


def _behind(surface, camera, settings, low, high, spacing) -> Body:
    step = spacing / settings.per_cell ** (1 / 3)
    columns = _columns(surface, camera, settings, low, high, step)
    layers = np.maximum(np.rint((columns.end - columns.begin) / step).astype(int), 1)
    owner = np.repeat(np.arange(len(layers)), layers)
    layer = np.arange(len(owner)) - np.repeat(np.cumsum(layers) - layers, layers)
    thick = ((columns.end - columns.begin) / layers)[owner]
    z = columns.begin[owner] + (layer + 0.5) * thick
    rest = np.concatenate([columns.xy[owner], z[:, None]], 1)
    held = layer >= layers[owner] - settings.held_rear
    held |= (_border_distance(columns.cell) <= settings.held_border)[owner]
    return Body(
        rest=rest.astype(np.float32),
        volume=(thick * columns.area).astype(np.float32),
        color=surface.at(camera, rest)[1].astype(np.float32),
        surface=(layer == 0) & columns.seen[owner],
        held=held,
        spacing=spacing,
    )


def _columns(surface, camera, settings, low, high, step) -> _Columns:
    count = np.maximum(np.rint((high[:2] - low[:2]) / step).astype(int), 1)
    x, y = (low[a] + (high[a] - low[a]) * (np.arange(count[a]) + 0.5) / count[a] for a in range(2))
    xy = np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)
    cell = np.stack(np.meshgrid(np.arange(count[0]), np.arange(count[1])), -1).reshape(-1, 2)[:, ::-1]
    longest = float(max(high[:2] - low[:2]))
    thickness = settings.thickness
    if thickness is not None and settings.thickness_unit == "longest side":
        thickness *= longest
    deepest = settings.back * high[2] if thickness is None else high[2] + thickness + 2 * step
    depths = np.linspace(low[2], deepest, max(int(np.ceil((deepest - low[2]) / step)), 2) * FINE)
    samples = (len(xy), len(depths), 2), (len(xy), len(depths), 1)
    points = [np.broadcast_to(a, n) for a, n in zip((xy[:, None], depths[:, None]), samples, strict=True)]
    above, _, seen = surface.at(camera, np.concatenate(points, -1))
    gap = depths - above
    within = seen & (gap >= 0)
    first = np.argmax(within, 1)
    each = np.arange(len(xy))
    # Between the sample in front of the surface and the one behind it, the gap is all but straight.
    before = np.maximum(first - 1, 0)
    a, b = gap[each, before], gap[each, first]
    through = (first > 0) & (a < 0) & seen[each, before]
    share = np.where(through, -a / np.where(through, b - a, 1.0), 1.0)
    begin = np.where(through, depths[before] + share * (depths[first] - depths[before]), depths[first])
    end = np.full(len(xy), deepest)
    if thickness is not None:
        end = _depth_of_gap(depths, gap, thickness)
    there = within.any(1) & (end - begin > step / 2)
    if not there.any():
        raise Problem("thickening: nothing lies behind the surface inside the box. Raise 'back' or 'thickness'.")
    at_surface = through | ((first == 0) & (np.abs(b) <= step))
    area = float(np.prod((high[:2] - low[:2]) / count))
    return _Columns(xy[there], cell[there], begin[there], end[there], at_surface[there], area)


def _depth_of_gap(depths: np.ndarray, gap: np.ndarray, thickness: float) -> np.ndarray:
    """Depth from which a column stays farther than `thickness` behind the surface, (N,); the last depth if never."""
    outside = gap > thickness
    last = len(depths) - 1
    after = np.where(outside.all(1), 0, len(depths) - np.argmin(outside[:, ::-1], 1))
    k = np.clip(after, 1, last)
    each = np.arange(len(gap))
    a, b = gap[each, k - 1], gap[each, k]
    share = np.clip((thickness - a) / (b - a), 0, 1)
    return np.where(after > last, depths[last], depths[k - 1] + share * (depths[k] - depths[k - 1]))


def _border_distance(cell: np.ndarray) -> np.ndarray:
    """How many columns in from the border of the body each column stands, 1 at the border, (N,)."""
    low = cell.min(0)
    there = np.zeros(cell.max(0) - low + 3, bool)
    place = tuple((cell - low + 1).T)
    there[place] = True
    return ndimage.distance_transform_cdt(there, "chessboard")[place]


def largest_piece(rest: np.ndarray, spacing: float) -> tuple[np.ndarray, int]:
    """Particles of the largest connected piece, (P,) bool, and how many pieces there are.

    Particles are connected when their grid cells share a face.
    """
    cell = _cells(rest, spacing)
    full = np.zeros(cell.max(0) + 1, bool)
    full[tuple(cell.T)] = True
    labels, pieces = ndimage.label(full)
    mine = labels[tuple(cell.T)]
    return mine == np.argmax(np.bincount(mine)), pieces


def _literal(surface, camera, settings, centers, low, high, spacing) -> Body:
    """Algorithm 1 as printed, thinned at random to the density the grid needs."""
    if centers is None:
        raise Problem("thickening: the printed algorithm copies the scene's Gaussians, and none were passed.")
    rng = np.random.default_rng(settings.seed)
    high = high * [1, 1, settings.back]
    kept = [centers]
    for layer in range(1, LAYERS):
        copies = centers * (rng.random(centers.shape) + layer) / LAYERS
        kept.append(copies[np.all((copies >= low) & (copies <= high), 1)])
    # In random order, so that taking the first few of every cell thins without choosing.
    rest = rng.permutation(np.concatenate(kept))
    rest = rest[_first_in_cell(rest, spacing, settings.per_cell)]
    _, number = np.unique(_cells(rest, spacing), axis=0, return_inverse=True)
    above, color, _ = surface.at(camera, rest)
    held = rest[:, 2] >= rest[:, 2].max() - settings.held_rear * spacing / 2
    if settings.held_border:
        near = settings.held_border * spacing / 2
        held |= np.any((rest[:, :2] < low[:2] + near) | (rest[:, :2] > high[:2] - near), 1)
    return Body(
        rest=rest.astype(np.float32),
        volume=(spacing**3 / np.bincount(number)[number]).astype(np.float32),
        color=color.astype(np.float32),
        surface=np.abs(rest[:, 2] - above) < spacing / 2,
        held=held,
        spacing=spacing,
    )


def _first_in_cell(rest: np.ndarray, spacing: float, most: float) -> np.ndarray:
    """Whether a particle is among the first `most` of its grid cell, (P,) bool."""
    _, number = np.unique(_cells(rest, spacing), axis=0, return_inverse=True)
    order = np.argsort(number, kind="stable")
    begin = np.searchsorted(number[order], np.arange(number.max() + 1))
    rank = np.empty(len(rest), int)
    rank[order] = np.arange(len(rest)) - begin[number[order]]
    return rank < most


def _cells(rest: np.ndarray, spacing: float) -> np.ndarray:
    """Grid cell of every particle, counted from the lowest, (P, 3) int."""
    return np.floor((rest - rest.min(0)) / spacing).astype(int)
