"""Colour of tissue and steel under a lamp at the camera, and what the sensor makes of it."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from surgisim.phantom.block import Block, Shape
from surgisim.phantom.instrument import JAW, SHAFT
from surgisim.phantom.texture import Texture
from surgisim.phantom.view import Hits


@dataclass(frozen=True)
class Lamp:
    """At the camera; light falls off with the distance squared."""

    distance: float
    """Where a white surface facing the camera is just white [m]."""
    vignette: float
    """Loss of light at the image's corners, 0-1."""


@njit(cache=True)
def _normals(points, triangles, out):
    for f in range(len(triangles)):
        a, b, c = triangles[f]
        n = np.cross(points[b] - points[a], points[c] - points[a])
        out[a] += n
        out[b] += n
        out[c] += n


def tissue(
    hits: Hits, rays: np.ndarray, points: np.ndarray, block: Block, shape: Shape, texture: Texture, lamp: Lamp
) -> np.ndarray:
    """Linear light of every ray, (H, W, 3) float; black where nothing is met."""
    corner = np.zeros_like(points)
    _normals(points, block.triangles, corner)
    out = np.zeros((*hits.z.shape, 3))
    arrays = block.triangles, block.uv, corner, texture.low, texture.albedo, texture.slope, texture.gloss, shape.axes
    _tissue(hits.z, hits.triangle, hits.weights, rays, *arrays, _pitch(texture, shape), lamp.distance, out)
    return out


def _pitch(texture: Texture, shape: Shape) -> np.ndarray:
    return (shape.high - shape.low) / (np.array(texture.gloss.shape[::-1]) - 1)


@njit(cache=True)
def _tissue(z, triangle, weights, rays, triangles, uv, corner, low, albedo, slope, gloss, axes, pitch, distance, out):
    rows, columns = gloss.shape
    n = np.zeros(3)
    for y in range(z.shape[0]):
        for x in range(z.shape[1]):
            f = triangle[y, x]
            if f < 0:
                continue
            n[:] = 0.0
            u = v = 0.0
            for k in range(3):
                share, a = weights[y, x, k], triangles[f, k]
                u += share * uv[a, 0]
                v += share * uv[a, 1]
                n += share * corner[a]
            # Bilinear look-up, at the edge the last texel.
            p = min(max((u - low[0]) / pitch[0], 0.0), columns - 1.001)
            q = min(max((v - low[1]) / pitch[1], 0.0), rows - 1.001)
            i, j = int(p), int(q)
            p, q = p - i, q - j
            w00, w10, w01, w11 = (1 - p) * (1 - q), p * (1 - q), (1 - p) * q, p * q
            su = w00 * slope[j, i, 0] + w10 * slope[j, i + 1, 0] + w01 * slope[j + 1, i, 0] + w11 * slope[j + 1, i + 1, 0]
            sv = w00 * slope[j, i, 1] + w10 * slope[j, i + 1, 1] + w01 * slope[j + 1, i, 1] + w11 * slope[j + 1, i + 1, 1]
            shine = w00 * gloss[j, i] + w10 * gloss[j, i + 1] + w01 * gloss[j + 1, i] + w11 * gloss[j + 1, i + 1]
            n /= np.sqrt((n * n).sum())
            n -= su * axes[0] + sv * axes[1]
            n /= np.sqrt((n * n).sum())
            away = np.sqrt((rays[y, x] ** 2).sum())
            facing = abs((n * rays[y, x]).sum()) / away
            light = (distance / (z[y, x] * away)) ** 2
            glint = 0.9 * shine * facing**220 + 0.05 * shine * facing**24
            for c in range(3):
                a = (
                    w00 * albedo[j, i, c]
                    + w10 * albedo[j, i + 1, c]
                    + w01 * albedo[j + 1, i, c]
                    + w11 * albedo[j + 1, i + 1, c]
                )
                out[y, x, c] = light * (a * (0.06 + 0.94 * facing) + glint)


def steel(rays: np.ndarray, z: np.ndarray, normal: np.ndarray, part: np.ndarray, station: np.ndarray, lamp: Lamp):
    """Linear light of rays that meet the instrument, (R, 3)."""
    away = np.linalg.norm(rays, axis=-1)
    facing = np.clip(-np.sum(normal * rays, -1) / away, 0, 1)
    light = (lamp.distance / (z * away)) ** 2
    grey = np.where(part == SHAFT, 0.13, np.where(part == JAW, 0.34, 0.26))
    bands = np.where((part == SHAFT) & (station > 1.5e-3) & (station < 2.6e-3), 0.5, 1.0)
    teeth = np.where(part == JAW, 0.85 + 0.15 * np.sign(np.sin(station * 2 * np.pi / 1.1e-3)), 1.0)
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
