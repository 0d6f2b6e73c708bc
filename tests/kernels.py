"""Calls after which the kernels that most tests use are compiled and kept."""

from pathlib import Path

import numpy as np

from catalogs.entries import load
from flows.making.generate import generate_dataset
from tasks.eval.poses.rigid import project_points
from tasks.eval.poses.solve_pnp import PnpLimits, solve_pnp
from tasks.render.rasterise.rasteriser import prepare_gaussians, rasterise_view
from tasks.surface.road_profile import FLAT_ROAD
from tasks.surface.state import SurfaceState
from tasks.vehicle.brake import BrakeCommand
from tasks.vehicle.rollout import Controls, simulate_scenario
from tests.toy_street import toy_street, write_toy_grid

GRID = """\
name: toy
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 2
frame_rate_hz: 10
scenarios:
  clip: {{weather: rain, precipitation_mm_h: 50, initial_speed_km_h: 40, hazard_center_m: 4, hazard_length_m: 3.7,
          hazard_height_m: 0.075}}
"""
K = np.array([[80.0, 0.0, 48.0], [0.0, 80.0, 32.0], [0.0, 0.0, 1.0]])


def compile_rasteriser(_: Path) -> None:
    """Draw a picture."""
    rasterise_view(prepare_gaussians(toy_street().gaussians), np.eye(4), K, 96, 64)


def compile_vehicle(_: Path) -> None:
    """Drive in both modes."""
    brake = BrakeCommand(
        peak_pressure_mpa=2.3, onset_s=0.1, ramp_s=0.5, onset_station_m=None, hold_s=None, release_s=0.5
    )
    controls = Controls(initial_speed=10.0, brake=brake, hold_speed_until_brake=False)
    surface = SurfaceState(kind="dry", friction=0.82)
    for mode in ("coupled", "paper"):
        simulate_scenario(
            load("vehicle", "paper-reference"), surface, controls, FLAT_ROAD, mode=mode, duration_s=0.2,
            step_s=0.0005,
        )  # fmt: skip


def compile_pose_solver(_: Path) -> None:
    """Place a camera by points."""
    points = np.random.default_rng(1).uniform((-2, -2, 4), (2, 2, 9), (40, 3))
    limits = PnpLimits(min_inliers=8, noise_floor=0.05, noise_ceiling=2.0)
    solve_pnp(points, project_points(points, K), np.eye(4), K, limits)


def compile_rain(folder: Path) -> None:
    """Make a dataset with rain, on a road that mirrors."""
    generate_dataset(write_toy_grid(folder, GRID), str(folder / "data"), runner="threads", workers=1)
