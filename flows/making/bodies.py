"""The bodies of a clip's road users: built in as fine as the camera comes near, or a user's own."""

from collections.abc import Mapping
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from catalogs.scenario import Scenario
from catalogs.scenes.gaussian_files import read_gaussians
from tasks.render.moving_bodies import MovingBody
from tasks.scene.road_users.bodies import COARSEST_M, FINEST_M, build_road_user, wrap_own_body
from tasks.scene.road_users.motion import Motion

CELL_PX = 2.5
"""Spacing of the discs of a body in the picture, where it is nearest [px]."""


class BodySource(Protocol):
    """What bodies are built from: sizes by kind [m], and bodies of the user's by name."""

    @property
    def road_user_sizes(self) -> Mapping[str, tuple[float, ...]]:
        """Kind to length, width and height [m]."""

    def own_body(self, name: str) -> Path:
        """Return the file of a body that a scenario names."""


def build_moving_bodies(
    scenario: Scenario,
    catalogue: BodySource,
    motions: list[Motion],
    T_world_camera: NDArray[np.float64],
    focal_px: float,
) -> list[MovingBody]:
    """Return the bodies of a scenario's road users on their way; numbers count from 1 in its order.

    Parameters
    ----------
    scenario : of the clip
    catalogue : of the dataset, or of a drive by steps
    motions : of each, at the frames
    T_world_camera : float64 [F, 4, 4] poses of the camera, which decide how fine a body is [m]
    focal_px : focal length of the camera, which decides it too [px]
    """
    bodies = []
    for number, (user, motion) in enumerate(zip(scenario.objects, motions, strict=True), start=1):
        size = np.array(user.choose_size(catalogue.road_user_sizes))
        if user.body is not None:
            body = wrap_own_body(user.kind, size, read_gaussians(catalogue.own_body(user.body)))
        else:
            cell = _choose_cell(motion, size, T_world_camera, focal_px)
            body = build_road_user(user.kind, size, cell)
        bodies.append(
            MovingBody(
                number=number,
                body=body,
                T_world_body=motion.T_world_body,
                velocity=motion.velocity,
                braking=motion.acceleration < 0,
            )
        )
    return bodies


def _choose_cell(
    motion: Motion, size: NDArray[np.float64], T_world_camera: NDArray[np.float64], focal_px: float
) -> float:
    """Return the spacing of a body's discs, some pixels where the camera comes nearest, in steps of a quarter [m]."""
    away = np.linalg.norm(motion.T_world_body[:, :3, 3] - T_world_camera[:, :3, 3], axis=1).min()
    cell = CELL_PX * max(float(away) - float(size[:2].max()) / 2, 1.0) / focal_px
    steps = np.floor(np.log(np.clip(cell, FINEST_M, COARSEST_M) / FINEST_M) / np.log(1.25) + 1e-9)
    return round(float(FINEST_M * 1.25**steps), 4)
