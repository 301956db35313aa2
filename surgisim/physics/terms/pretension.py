"""Pretension: tissue that is taut in what the camera first sees.

    psi = along |F a| + across |cof(F) a|                             [J/m^3]
    sigma = (along Fa (x) Fa / |Fa| + across (c I - Ca (x) Ca / c)) / J       [Pa],  Ca = cof(F) a,  c = |Ca|

Along a, threads of constant tension `along` [Pa]; across a, films of constant tension `across` [Pa], as soap has.
Both turn with the tissue, and their tension does not grow with strain, so they add what is pretension's own,
resistance to bending and lifting, and leave stretching to the elastic laws. The surroundings hold the first frame
in equilibrium: the stress at rest is taken off again as a dead load. a (by yaw and pitch, see physics/heading.py)
by default points into the tissue: taut like a skin. Smooth everywhere, and linear in both tensions.
Biot, Mechanics of Incremental Deformations (1965), chapter 2.
"""

from typing import Any

import numpy as np
import warp as wp

from surgisim.physics.catalogue import Param, Term
from surgisim.physics.heading import heading


@wp.func
def stress(F: Any, D: Any, theta: Any):
    a = wp.vector(theta[2], theta[3], theta[4], dtype=F.dtype)
    J = wp.determinant(F)
    Fa = F * a
    Ca = J * (wp.transpose(wp.inverse(F)) * a)
    c = wp.length(Ca)
    thread = (theta[0] / wp.length(Fa)) * wp.outer(Fa, Fa)
    film = theta[1] * (c * wp.identity(n=3, dtype=F.dtype) - wp.outer(Ca, Ca) / c)
    return (thread + film) / J


def _normal(F, x, y, z):
    return np.linalg.det(F)[..., None] * (np.swapaxes(np.linalg.inv(F), -1, -2) @ np.array([x, y, z]))


def twin(F, D, along, across, **axis):
    Fa, Ca = F @ np.array(list(axis.values())), _normal(F, **axis)
    length, area = (np.linalg.norm(x, axis=-1)[..., None, None] for x in (Fa, Ca))
    thread = along * Fa[..., :, None] * Fa[..., None, :] / length
    film = across * (area * np.eye(3) - Ca[..., :, None] * Ca[..., None, :] / area)
    return (thread + film) / np.linalg.det(F)[..., None, None]


def energy(F, along, across, **axis):
    Fa = F @ np.array(list(axis.values()))
    return along * np.linalg.norm(Fa, axis=-1) + across * np.linalg.norm(_normal(F, **axis), axis=-1)


def columns(along, across, yaw, pitch):
    x, y, z = heading(yaw, pitch)
    return {"along": along, "across": across, "x": x, "y": y, "z": z}


TERM = Term(
    stress=stress,
    twin=twin,
    energy=energy,
    wave_modulus=lambda along, across, **axis: along + across,
    columns=columns,
    rests=False,
    balanced=True,
    params={
        "along": Param("Pa", low=1e0, high=1e4, default=1e2, off=0.0),
        "across": Param("Pa", low=1e0, high=1e4, default=1e2, off=0.0),
        "yaw": Param("rad", low=-np.pi, high=np.pi, default=0.0, logarithmic=False),
        "pitch": Param("rad", low=-np.pi, high=np.pi, default=0.0, logarithmic=False),
    },
)
