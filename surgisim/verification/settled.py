"""A box of neo-Hookean tissue with one or two faces held, brought to rest by damping.

A held face is a sheet of particles on the face itself, with hardly any volume, anchored by springs of
HELD (lambda + 2 mu) / dx per area: the penalty form of a prescribed displacement (Babuska, The finite element method
with penalty, Math. Comp. 27, 1973). A layer of held particles behind the face, as a body has from `thickening`, gives
way over half a cell; it can be had for comparison.

Rest is reached by slowing every motion at twice the slowest mode's rate, which is critical damping; a little viscosity
takes the quick modes. Neither bears on where the body comes to rest.
"""

from dataclasses import dataclass, replace

import numpy as np

from surgisim.artifacts.body import Body
from surgisim.mpm.grip import ANCHOR, Drive
from surgisim.mpm.setup import Prepared, prepare
from surgisim.mpm.stable import largest_step
from surgisim.physics.catalogue import choose
from surgisim.physics.terms.corotated import wave_modulus
from surgisim.problem import Problem

PER_AXIS = 2
"""Particles along each side of a cell, as `thickening` lays them."""
HELD = 40.0
"""Springs of a held face, in units of the tissue's wave modulus over a cell."""
SHEET = 1e-3
"""Volume of a sheet's particle, as a share of the others'."""
SAFETY = 0.7
"""Of the largest stable step at rest."""
SLOWED = 60
"""How often the motion is slowed within a period of the slowest mode."""
PERIODS = 12
"""After so many periods of the slowest mode a body that still moves is given up."""


@dataclass(frozen=True)
class Laid:
    """A box on its grid."""

    made: Prepared
    theta: np.ndarray
    """The laws' columns, (P, M)."""
    nodes: np.ndarray
    """Rest positions of the nodes that move [m], (A, 3)."""
    member: np.ndarray
    """Bit 0: held at x = 0, bit 1: at the far end, (P,) int32."""
    spring: float
    """Of the sheets, per unit of mass [1/s^2]."""
    step: float
    """[s]"""


@dataclass(frozen=True)
class Settled:
    u: np.ndarray
    """Nodal displacement [m], (A, 3)."""
    left: float
    """About how far any node still has to go, as a share of the largest displacement: speed over slowest rate."""
    steps: int


def lay(
    size: tuple[float, float, float],
    spacing: float,
    *,
    E: float,
    nu: float,
    density: float,
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    both: bool = False,
    held: float = HELD,
    layer: bool = False,
) -> Laid:
    """A box that fills 0..size [m], held at x = 0 and, if `both`, at the other end; its faces are cell faces.

    layer: it continues behind x = 0 by a cell, which is held as the engine holds a body, instead of a sheet.
    """
    count = np.round(np.array(size) / spacing * PER_AXIS).astype(int)
    part = np.array(size) / count
    first = (-PER_AXIS if layer else 0, 0, 0)
    axes = [(np.arange(f, n) + 0.5) * s for f, n, s in zip(first, count, part, strict=True)]
    inner = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    sheet = inner[: count[1] * count[2]] * [0, 1, 1]
    sheets = [] if layer else [sheet, sheet + np.array([size[0], 0, 0])][: 1 + both]
    rest = np.concatenate([inner, *sheets])
    member = np.concatenate([inner[:, 0] < 0, *[np.full(len(sheet), 1 << j) for j in range(len(sheets))]])
    volume = np.where(np.arange(len(rest)) < len(inner), 1.0, SHEET) * part.prod()
    body = Body(
        rest.astype(np.float32), volume.astype(np.float32), np.full(rest.shape, 0.5, np.float32),
        np.zeros(len(rest), bool), member > 0, spacing,
    )  # fmt: skip
    corners = np.array([(axes[0][0] - part[0] / 2, 0.0, 0.0), size])
    laws = ("neo_hookean", "newtonian")
    made = prepare(body, laws, density=density, gravity=gravity, carried=corners)
    speed = (wave_modulus(E, nu) / density) ** 0.5
    values = {"neo_hookean": {"E": E, "nu": nu}, "newtonian": {"eta": 0.1 * density * speed * spacing}}
    theta = made.theta(values)
    # The quickest mode is an edge of a held face; (w dx / c)^2 by power iteration: 9 at held 4, 21 at 10, 58 at 30.
    edge = 2 * spacing / speed / (3 + 2 * held) ** 0.5
    step = SAFETY * min(edge, largest_step(choose(laws), made.stiffest(theta), density, spacing))
    nodes = made.simulator.grid.positions()[made.simulator.place]
    # Per area held (lambda + 2 mu) / dx; a sheet weighs density SHEET part[0] per area.
    spring = held * speed**2 / spacing / (SHEET * part[0])
    if layer:
        spring = ANCHOR * E / (2 * (1 + nu) * density) / spacing**2
    return Laid(made, theta, nodes, member.astype(np.int32), spring, step)


def settle(
    laid: Laid, slowest: float, begin: np.ndarray, *, far: np.ndarray | None = None, center=(0.0, 0.0, 0.0), left: float
) -> Settled:
    """Rest, from nodes displaced by `begin` [m], (A, 3), until no node is `left` of the largest displacement away.

    slowest: circular frequency of the slowest mode [rad/s], to a third; far: x - center becomes far (x - center) at
    the far end, (3, 3). Raises Problem if the body still moves after PERIODS periods.
    """
    period = 2 * np.pi / slowest
    every = max(10, round(period / SLOWED / laid.step))
    ends = 1 if far is None else 2
    turn = None if far is None else np.broadcast_to(np.stack([np.eye(3), far])[:, None], (2, every + 1, 3, 3))
    drive = Drive(
        member=laid.member,
        share=np.ones(len(laid.member)),
        path=np.zeros((ends, every + 1, 3)),
        hold=np.ones((ends, every)),
        step=laid.step,
        per_frame=every,
        stiffness=np.tile(laid.spring * np.eye(3), (ends, 1, 1)),
        center=np.tile(center, (ends, 1)),
        turn=turn,
    )
    one = replace(drive, per_frame=1, path=drive.path[:, :2], hold=drive.hold[:, :1])
    u, v = begin, np.zeros_like(begin)
    slowing = np.exp(-2 * slowest * every * laid.step)
    for done in range(1, 1 + round(PERIODS * period / (every * laid.step))):
        run = laid.made.simulator.run(laid.theta, drive, begin=(u, v))
        u, v = run.u[-1], run.v[-1]
        # The engine's velocity is half a step behind. Slowing that one would pump a quick mode that is met in the same
        # phase each time; slowing the one at the same time as u only takes energy.
        gained = laid.made.simulator.run(laid.theta, one, begin=(u, v)).v[-1] - v
        moving = v + gained / 2
        v = slowing * moving - gained / 2
        away = float(np.abs(moving).max() / slowest / np.abs(u).max())
        if away <= left:
            return Settled(u, away, done * (every + 1))
    raise Problem(
        f"settled: after {PERIODS} periods a node is still {away:.1e} of the largest displacement from rest, "
        f"{left:.1e} is wanted. Give a better guess of the slowest mode, or take a smaller step."
    )


def carried(coarse: Laid, u: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Displacement [m] of points [m], (Q, 3), that nodes displaced by u (A, 3) carry."""
    return coarse.made.simulator.carry(points) @ u.astype(float)
