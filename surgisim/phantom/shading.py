"""Colour of tissue and steel under a lamp at the camera, and what the sensor makes of it."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from surgisim.phantom.block import Block, Shape
from surgisim.phantom.instrument import JAW, SHAFT
from surgisim.phantom.texture import Texture
from surgisim.phantom.view import Hits

AMBIENT, SHARP, BROAD = 0.06, 1.6, 0.06
"""Shares of light: from all around; of a wet film's glints, and its sheen."""


@dataclass(frozen=True)
class Lamp:
    """At the camera; light falls off with the distance squared."""

    distance: float
    """Where a white surface facing the camera is just white [m]."""
    vignette: float
    """Loss of light at the image's corners, 0-1."""


def tissue(
    hits: Hits, rays: np.ndarray, points: np.ndarray, block: Block, shape: Shape, texture: Texture, lamp: Lamp
) -> np.ndarray:
    """Linear light of every ray, (H, W, 3) float; black where nothing is met."""
    corner = np.zeros_like(points)
    _normals(points, block.triangles, corner)
    out = np.zeros((*hits.z.shape, 3))
    skin = block.triangles, block.uv, corner, shape.low, texture.layers, shape.axes
    pitch = (shape.high - shape.low) / (np.array(texture.layers.shape[1::-1]) - 1)
    _tissue(hits.z, hits.triangle, hits.weights, rays, *skin, pitch, lamp.distance, out)
    return out


@njit(cache=True)
def _normals(points, triangles, out):
    """Add to each corner the triangle's normal, as long as twice its area."""
    for f in range(len(triangles)):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
        vx, vy, vz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        for k in (a, b, c):
            out[k, 0] += nx
            out[k, 1] += ny
            out[k, 2] += nz


@njit(cache=True)
def _tissue(z, triangle, weights, rays, triangles, uv, corner, low, paint, axes, pitch, distance, out):
    rows, columns, layers = paint.shape
    texel = np.zeros(layers)
    for y in range(z.shape[0]):
        for x in range(z.shape[1]):
            f = triangle[y, x]
            if f < 0:
                continue
            u = v = nx = ny = nz = 0.0
            for k in range(3):
                share, a = weights[y, x, k], triangles[f, k]
                u += share * uv[a, 0]
                v += share * uv[a, 1]
                nx += share * corner[a, 0]
                ny += share * corner[a, 1]
                nz += share * corner[a, 2]
            # Bilinear look-up, at the edge the last texel.
            p = min(max((u - low[0]) / pitch[0], 0.0), columns - 1.001)
            q = min(max((v - low[1]) / pitch[1], 0.0), rows - 1.001)
            i, j = int(p), int(q)
            p, q = p - i, q - j
            for c in range(layers):
                upper = (1 - p) * paint[j, i, c] + p * paint[j, i + 1, c]
                texel[c] = (1 - q) * upper + q * ((1 - p) * paint[j + 1, i, c] + p * paint[j + 1, i + 1, c])
            size = np.sqrt(nx * nx + ny * ny + nz * nz)
            nx = nx / size - texel[3] * axes[0, 0] - texel[4] * axes[1, 0]
            ny = ny / size - texel[3] * axes[0, 1] - texel[4] * axes[1, 1]
            nz = nz / size - texel[3] * axes[0, 2] - texel[4] * axes[1, 2]
            dx, dy = rays[y, x, 0], rays[y, x, 1]
            away = np.sqrt(dx * dx + dy * dy + 1.0)
            facing = abs(nx * dx + ny * dy + nz) / (away * np.sqrt(nx * nx + ny * ny + nz * nz))
            light = (distance / (z[y, x] * away)) ** 2
            glint = texel[5] * (SHARP * facing**400 + BROAD * facing**30)
            for c in range(3):
                out[y, x, c] = light * (texel[c] * (AMBIENT + (1 - AMBIENT) * facing) + glint)


def steel(rays: np.ndarray, z: np.ndarray, normal: np.ndarray, part: np.ndarray, station: np.ndarray, lamp: Lamp):
    """Linear light of rays that meet the instrument, (R, 3)."""
    away = np.linalg.norm(rays, axis=-1)
    facing = np.clip(-np.sum(normal * rays, -1) / away, 0, 1)
    light = (lamp.distance / (z * away)) ** 2
    grey = np.where(part == SHAFT, 0.13, np.where(part == JAW, 0.34, 0.26))
    bands = np.where((part == SHAFT) & (station > 1.5e-3) & (station < 2.6e-3), 0.5, 1.0)
    teeth = np.where(part == JAW, 0.92 + 0.08 * np.sign(np.sin(station * 2 * np.pi / 1.0e-3)), 1.0)
    body = (grey * bands * teeth * (0.10 + 0.90 * facing))[:, None] * np.array([0.96, 1.0, 1.03])
    # Wet walls all around shine back at grazing angles.
    walls = (0.10 * (1 - facing) ** 2)[:, None] * np.array([1.0, 0.42, 0.36])
    glint = np.where(part == SHAFT, 0.25, 0.8) * facing**40 * 0.45 + np.where(part == SHAFT, 0.2, 0.5) * facing**300
    return light[:, None] * (body + walls + glint[:, None])


def expose(linear: np.ndarray, samples: int, lamp: Lamp, noise: float, rng: np.random.Generator) -> np.ndarray:
    """Mean of the samples of each pixel, vignetting, shot and read noise, sRGB; (H s, W s, 3) to (H, W, 3) uint8."""
    h, w = linear.shape[0] // samples, linear.shape[1] // samples
    # A highlight brighter than white saturates the pixel, not the neighbours.
    pixel = np.minimum(linear, 4.0).reshape(h, samples, w, samples, 3).mean((1, 3))
    y, x = np.meshgrid(np.linspace(-1, 1, h), np.linspace(-1, 1, w), indexing="ij")
    pixel = pixel * (1 - lamp.vignette * ((x * x + y * y) / 2) ** 1.5)[..., None]
    sigma = noise * np.sqrt(0.15 + 0.85 * np.minimum(pixel, 1.0))
    pixel = np.clip(pixel + sigma * rng.standard_normal(pixel.shape), 0, 1)
    srgb = np.where(pixel <= 0.0031308, 12.92 * pixel, 1.055 * pixel ** (1 / 2.4) - 0.055)
    return np.rint(255 * srgb).astype(np.uint8)
