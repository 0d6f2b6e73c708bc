"""A small stereo drive through a speckled street, pictured by the project's own renderer: everything is known."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import SemanticClass
from tasks.reconstruction.sequence import StereoSequence
from tasks.render.camera import world_to_camera
from tasks.render.composition import encode_8bit
from tasks.render.environment import environment_view
from tasks.render.rasterise.rasteriser import PreparedGaussians, prepare_gaussians, rasterise_view
from tasks.scene.gaussians import Gaussians
from tasks.scene.spherical_harmonics import C0

WIDTH, HEIGHT, FOCAL, BASELINE, CAMERA_HEIGHT = 208, 120, 150.0, 0.5, 1.5
KERB_LEFT, KERB_RIGHT, KERB_HEIGHT = 2.5, -3.0, 0.2
GAINS = (1.0, 1.25, 1.1, 0.9, 0.8, 1.0, 1.15)
AXES = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])
"""Camera axes in the street's: x along the street, y left, z up."""


@dataclass(frozen=True, kw_only=True)
class StereoSet:
    """The sequence, and the truth it was made from.

    Parameters
    ----------
    sequence : pictures, with poses in an arbitrary frame
    street : the street that was pictured, prepared
    environment : its sky
    T_street_camera : float64 [F, 4, 4] true poses, road at z = 0
    K : float64 [3, 3] camera matrix, pixel centres at +0.5 [px]
    """

    sequence: StereoSequence
    street: PreparedGaussians
    environment: NDArray[np.float32]
    T_street_camera: NDArray[np.float64]
    K: NDArray[np.float64]


def stereo_set(frames: int = 7, step: float = 0.7) -> StereoSet:
    """Pictures every ``step`` metres, with gains that change from frame to frame."""
    street, environment = prepare_gaussians(_build_street()), _build_sky()
    K = np.array([[FOCAL, 0, WIDTH / 2], [0, FOCAL, HEIGHT / 2 - 10], [0, 0, 1]])
    poses = np.tile(np.eye(4), (frames, 1, 1))
    poses[:, :3, :3] = AXES
    poses[:, :3, 3] = np.stack(
        [step * np.arange(frames), np.zeros(frames), np.full(frames, CAMERA_HEIGHT)], axis=1
    )
    left, right = np.empty((2, frames, HEIGHT, WIDTH, 3), np.uint8)
    for i in range(frames):
        for side, pictures in ((0.0, left), (BASELINE, right)):
            pose = poses[i].copy()
            pose[:3, 3] += side * AXES[:, 0]
            view = world_to_camera(pose)
            gbuffer = rasterise_view(street, view, K, WIDTH, HEIGHT)
            sky = environment_view(environment, view, K, WIDTH, HEIGHT)
            light = gbuffer.rgb + (1 - gbuffer.alpha)[..., None] * sky
            pictures[i] = encode_8bit(light * np.float32(GAINS[i % len(GAINS)]))
    shifted = K.copy()
    shifted[:2, 2] -= 0.5
    origin = np.eye(4)
    origin[:3, :3] = np.linalg.qr(np.random.Generator(np.random.Philox(3)).normal(size=(3, 3)))[0]
    origin[:3, :3] *= np.linalg.det(origin[:3, :3])
    origin[:3, 3] = 5.0, -2.0, 1.0
    sequence = StereoSequence(
        name="speckles",
        left=left,
        right=right,
        intrinsics=shifted,
        baseline=BASELINE,
        T_origin_camera=origin @ poses,
    )
    return StereoSet(sequence=sequence, street=street, environment=environment, T_street_camera=poses, K=K)


def _build_street() -> Gaussians:
    """Road between kerbs, raised ground beside it, and two walls, all speckled at two scales."""
    draw = np.random.Generator(np.random.Philox(11))
    up, left, right = (0, 0, 1), (0, 1, 0), (0, -1, 0)
    road, kerb, ground, wall = (
        SemanticClass.ROAD,
        SemanticClass.KERB,
        SemanticClass.TERRAIN,
        SemanticClass.BUILDING,
    )
    parts = [
        _build_sheet(draw, up, 0.0, (KERB_RIGHT, KERB_LEFT), 0.08, road, 0.2),
        _build_sheet(draw, up, KERB_HEIGHT, (KERB_LEFT, 6), 0.1, ground, 0.1),
        _build_sheet(draw, up, KERB_HEIGHT, (-6, KERB_RIGHT), 0.1, ground, 0.1),
        _build_sheet(draw, right, KERB_LEFT, (0, KERB_HEIGHT), 0.05, kerb, 0.05),
        _build_sheet(draw, left, KERB_RIGHT, (0, KERB_HEIGHT), 0.05, kerb, 0.4),
        _build_sheet(draw, right, 6.0, (0, 3.2), 0.1, wall, 0.35),
        _build_sheet(draw, left, -6.0, (0, 2.4), 0.1, wall, 0.3),
    ]
    names = ("means", "quats_wxyz", "scales", "opacities", "sh", "normals", "class_id")
    return Gaussians(**{name: np.concatenate([part[name] for part in parts]) for name in names})


def _build_sheet(
    draw: np.random.Generator,
    normal: tuple[int, int, int],
    offset: float,
    extent: tuple[float, float],
    pitch: float,
    label: SemanticClass,
    brightness: float,
) -> dict[str, NDArray[Any]]:
    """Discs on a plane along the street, at an offset along its normal's axis, over an extent across."""
    along, across = np.meshgrid(np.arange(1, 42, pitch), np.arange(*extent, pitch), indexing="ij")
    a, b = along.ravel(), across.ravel()
    coarse = draw.uniform(0.5, 1.5, (100, 100))[(a / 0.5).astype(int), ((b - extent[0]) / 0.5).astype(int)]
    colour = (brightness * coarse * draw.uniform(0.4, 1.6, len(a)))[:, None] * (1.0, 0.95, 0.9)
    level = np.full(len(a), offset)
    means = np.stack([a, b, level] if normal[2] else [a, level, b], axis=1)
    scales = np.where(np.abs(normal), 0.1, 1.0) * np.full((len(a), 3), 0.62 * pitch)
    return {
        "means": means.astype(np.float32),
        "quats_wxyz": np.tile(np.array([1, 0, 0, 0], np.float32), (len(a), 1)),
        "scales": scales.astype(np.float32),
        "opacities": np.full(len(a), 0.95, np.float32),
        "sh": ((colour - 0.5) / C0).astype(np.float32)[:, None, :],
        "normals": np.tile(np.array(normal, np.float32), (len(a), 1)),
        "class_id": np.full(len(a), label, np.uint8),
    }


def _build_sky() -> NDArray[np.float32]:
    """Brighter towards the horizon, and a little towards the left."""
    elevation = np.pi * (0.5 - (np.arange(64) + 0.5) / 64)
    azimuth = np.pi * (1 - (2 * np.arange(128) + 1) / 128)
    grey = 0.55 - 0.25 * elevation[:, None] + 0.03 * azimuth[None, :]
    return (grey[..., None] * (0.9, 0.95, 1.0)).astype(np.float32)
