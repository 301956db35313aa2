"""A silicone dumbbell hung out level by one end, from one depth picture: its midline as tracked points.

What is seen is where it came to rest, so the points are seen in the first frame (straight, as it was cast) and in the
last ones. The depth itself is not used: in it the two silicones, which touch, lie 28 mm apart at their seam. Used is
the outline, whose midline lies in a plane nearly parallel to the picture, with the bar's own width as its measure: by
it the free head is as wide as it was cast, and the last centimetre of the bar lies behind the edge of the clamp. The
clamp holds the head alone, and not its first centimetre (the makers' h_em_c.exp: x > 7 cm).
Arnavaz, Nielsen, Kry, Macklin and Erleben, Differentiable depth for real2sim calibration of soft body simulations,
CGF 42 (2023); their mesh, in centimetres, with material 1 at x < 0 and material 2 beyond.
"""

from pathlib import Path

import numpy as np
from scipy.ndimage import binary_fill_holes, label

from surgisim.problem import Problem
from surgisim.recordings.mesh import Mesh, closed
from surgisim.recordings.recording import Recording, no_grips

WINDOW = np.array([[480, 235], [731, 515]])
"""Where the bar and its free head are in the picture [px]: left top, right bottom; the clamp is its right edge."""
BETWEEN = (0.3, 0.55)
"""Depth there [m]."""
START, BEGIN = np.array([704.0, 291.0]), np.radians(30.0)
"""A pixel on the midline near the clamp, and the bar's slope there."""
VERTICAL = np.array([733 - 727, 362 - 205])
"""Along the clamp's left edge, downwards [px]."""
BAR, WIDE, HELD = 0.12, 0.03, 0.07
"""Length of the bar [m], from x = 6 cm at the clamp to x = -6 cm at the free head; its width; from which x on it is
held."""
STRIDE, TURN = 4.0, np.radians(np.arange(-12, 12.1, 1.5))
"""Steps along the midline [px], and by how much its direction may change in one."""
WIDER = 1.35
"""The head begins where the outline is this much wider than the bar."""
APART = 0.0075
"""Of the points along the bar [m]."""
FPS, FRAMES, SEEN = 10.0, 25, 1
"""[1/s]; frames in all, and those at the end in which the beam has come to rest: there is one picture."""
SIGMA = 1e-3
"""Two pixels: how well the midline is known [m]."""
DENSITY = 1080.0
"""The makers' [kg/m^3]."""
GRAVITY = 9.81


def hanging(depth: np.ndarray, tets: Path) -> Recording:
    """The beam as a recording; x along the cast bar from the free end to the clamp, y up. Depth (H, W) [m]."""
    path, width = midline(outline(depth))
    scale = WIDE / width
    down = VERTICAL / np.linalg.norm(VERTICAL)
    out = np.array([-down[1], down[0]])
    away = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))]) * scale
    # Counted from the free head, which is seen; the edge of the clamp is where the bar begins to be.
    edge = away[-1] - BAR / 2
    flat = (path - path[0]) * scale
    first = flat[np.searchsorted(away, 2 * APART)]
    # Unseen it bends evenly from level where it is held to the slope with which it comes out.
    slope, hidden = np.arctan2(first @ down, first @ out), HELD - edge
    begin = hidden / slope * np.array([np.sin(slope), 1 - np.cos(slope)])
    at = np.arange(APART, away[-1] - APART / 2, APART)
    along, fallen = (np.interp(at, away, flat @ axis) + by for axis, by in zip((out, down), begin, strict=True))
    place = np.stack([edge - at, 0 * at, 0 * at], 1)
    rested = np.stack([HELD - along, -fallen, 0 * at], 1)
    visible = np.zeros((len(at), FRAMES), bool)
    visible[:, [0, *range(FRAMES - SEEN, FRAMES)]] = True
    points = np.where(np.arange(FRAMES)[:, None] == 0, place[:, None], rested[:, None])
    mesh = closed(surface(tets), tets.name)
    low, high = mesh.vertices.min(0) - 1e-3, mesh.vertices.max(0) + 1e-3
    return Recording(
        name="beam",
        fps=FPS,
        mesh=mesh,
        boxes=np.array([[[HELD, *low[1:]], high]]),
        points=np.where(visible[..., None], points, np.nan).astype(np.float32),
        visible=visible,
        sigma=np.full(len(at), SIGMA),
        motion=no_grips(FRAMES),
        density=DENSITY,
        gravity=(0.0, -GRAVITY, 0.0),
        starts="released",
        place=place,
        split={"fit": (0, FRAMES), "held_out": (FRAMES, FRAMES)},
    )


def outline(depth: np.ndarray) -> np.ndarray:
    """The bar and its free head, (H, W) bool."""
    mask = np.zeros(depth.shape, bool)
    (left, top), (right, bottom) = WINDOW
    inside = depth[top:bottom, left:right]
    mask[top:bottom, left:right] = (inside > BETWEEN[0]) & (inside < BETWEEN[1])
    parts, count = label(mask)
    if not count:
        raise Problem("no beam is in the depth picture's window. Pass the picture of the hanging bar of two silicones.")
    sizes = np.bincount(parts.ravel())[1:]
    return binary_fill_holes(parts == 1 + int(sizes.argmax()))


def midline(mask: np.ndarray) -> tuple[np.ndarray, float]:
    """Middle of the bar from the clamp to the free head [px], (N, 2), and its width [px].

    Each step goes where the outline is narrowest.
    """
    point, heading = START.copy(), np.pi - BEGIN
    path, widths = [], []
    while True:
        tried = [(_across(mask, point, heading + turn), heading + turn) for turn in TURN]
        (low, high), heading = min(((c, h) for c, h in tried if c), key=lambda t: t[0][1] - t[0][0])
        if len(widths) > 5 and high - low > WIDER * np.median(widths):
            break
        point = point + _normal(heading) * (low + high) / 2
        path.append(point)
        widths.append(high - low)
        point = point + STRIDE * np.array([np.cos(heading), np.sin(heading)])
    # Backwards to the clamp, straight: there the outline is the clamp's own.
    first = np.array(path[0])
    slope = (np.array(path[3]) - first) / np.linalg.norm(np.array(path[3]) - first)
    steps = (first[0] - WINDOW[1, 0] + 2) / slope[0]
    whole = _smooth(np.array([first - slope * s for s in np.arange(steps, 0, -STRIDE)] + path))
    return whole, float(np.median(widths))


def _across(mask: np.ndarray, point: np.ndarray, heading: float) -> tuple[float, float] | None:
    """How far the outline reaches to both sides of a point [px]; None outside of it."""
    steps = np.arange(-70, 70, 0.25)
    x, y = np.rint(point[:, None] + _normal(heading)[:, None] * steps).astype(int)
    on = mask[y.clip(0, mask.shape[0] - 1), x.clip(0, mask.shape[1] - 1)]
    middle = len(steps) // 2
    if not on[middle]:
        return None
    off = np.flatnonzero(~on)
    before, after = off[off < middle], off[off > middle]
    return float(steps[before.max(initial=0)]), float(steps[after.min(initial=len(steps) - 1)])


def _normal(heading: float) -> np.ndarray:
    return np.array([-np.sin(heading), np.cos(heading)])


def _smooth(path: np.ndarray, degree: int = 5) -> np.ndarray:
    """A polynomial in the arc length; what a bar's bending cannot do is the outline's noise."""
    s = np.linspace(-1, 1, len(path))
    return np.stack([np.polynomial.Chebyshev.fit(s, column, degree)(s) for column in path.T], 1)


def surface(path: Path) -> Mesh:
    """Skin of a tetrahedral mesh of lines 'v x y z' [cm] and 't a b c d', in metres."""
    points, tets = [], []
    for line in path.read_text().splitlines():
        kind, *numbers = line.split() or [""]
        if kind == "v":
            points.append([float(x) for x in numbers])
        elif kind == "t":
            tets.append([int(x) for x in numbers])
    vertices, cells = 1e-2 * np.array(points), np.array(tets)
    if len(vertices) == 0 or len(cells) == 0:
        raise Problem(f"{path}: holds no tetrahedra in lines 'v' and 't'. Copy it again.")
    a, b, c, d = (vertices[cells[:, k]] for k in range(4))
    turned = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) < 0
    cells[turned] = cells[turned][:, [0, 2, 1, 3]]
    faces = np.concatenate([cells[:, k] for k in ([0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2])])
    _, first, count = np.unique(np.sort(faces, 1), axis=0, return_index=True, return_counts=True)
    skin = faces[np.sort(first[count == 1])]
    used, skin = np.unique(skin, return_inverse=True)
    return Mesh(vertices[used], skin.reshape(-1, 3))
