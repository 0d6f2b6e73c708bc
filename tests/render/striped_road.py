"""A level road with a bright crossing, and where a camera that drives towards it sees the crossing."""

import numpy as np

from tasks.conventions import SemanticClass
from tasks.render.camera import world_to_camera
from tasks.render.rasterise.rasteriser import prepare_gaussians, rasterise_view
from tasks.scene.gaussians import Gaussians
from tasks.scene.spherical_harmonics import C0

DARK = 0.1
"""Radiance of the road beside the crossing [1]."""


def striped_road() -> Gaussians:
    """A level road with a bright crossing from 18 to 19 m, in cells of 4 cm."""
    x, y = np.meshgrid(np.arange(6, 32, 0.04), np.arange(-0.3, 0.3, 0.04), indexing="ij")
    means = np.column_stack((x.ravel(), y.ravel(), 0 * x.ravel()))
    bright = ((means[:, 0] > 18) & (means[:, 0] < 19)).astype(np.float32)
    n = len(means)
    return Gaussians(
        means=means.astype(np.float32),
        quats_wxyz=np.tile(np.array([1, 0, 0, 0], np.float32), (n, 1)),
        scales=np.tile(np.array([0.03, 0.03, 0.001], np.float32), (n, 1)),
        opacities=np.full(n, 0.9, np.float32),
        sh=((DARK + 0.8 * bright - 0.5) / C0)[:, None, None].repeat(3, axis=2).astype(np.float32),
        normals=np.tile(np.array([0, 0, 1], np.float32), (n, 1)),
        class_id=np.full(n, SemanticClass.ROAD, np.uint8),
        antialiased=True,
    )


PHASES = np.arange(8) / 8
"""Places of the horizon within a pixel: over them the pixel grid averages out [px]."""


def crossing_row(road: Gaussians, advance: float) -> float:
    """How far below the horizon the crossing's middle is drawn, by the first moment of its light [px]."""
    pose = np.array([[0.0, 0, 1, advance], [-1, 0, 0, 0], [0, -1, 0, 1.4], [0, 0, 0, 1]])
    prepared, rows = prepare_gaussians(road), []
    for phase in PHASES:
        lens = np.array([[400.0, 0, 8], [0, 400.0, 20 + phase], [0, 0, 1]])
        got = rasterise_view(prepared, world_to_camera(pose), lens, 16, 100)
        light = got.rgb[:, 4:12, 0].mean(axis=1) / np.maximum(got.alpha[:, 4:12].mean(axis=1), 1e-6) - DARK
        light[got.alpha[:, 8] < 0.5] = 0
        rows.append((light * (np.arange(100) + 0.5)).sum() / light.sum() - lens[1, 2])
    return float(np.mean(rows))


def true_row(advance: float) -> float:
    return float((400 * 1.4 / (np.array([18.0, 19.0]) - advance)).mean())
