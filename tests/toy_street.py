"""A street of a few thousand Gaussians: enough for every stage of the pipeline to have something to do."""

from pathlib import Path

import numpy as np

from catalogs.scenes import write_scene
from tasks.conventions import SemanticClass
from tasks.scene.gaussians import Gaussians
from tasks.scene.route import Route
from tasks.scene.scene import Scene

TOY_CAMERA = """\
name: toy-96x64
width: {value: 96, unit: px, source: a fifth of a dashcam}
height: {value: 64, unit: px, source: a fifth of a dashcam}
focal_length: {value: 80, unit: px, source: a fifth of a dashcam}
behind_front_axle: {value: 0.6, unit: m, source: as a dashcam}
left_of_centre: {value: 0.0, unit: m, source: as a dashcam}
height_above_road: {value: 1.4, unit: m, source: as a dashcam}
exposure: {value: 0.008, unit: s, source: as a dashcam}
"""
TOY_GRID = """\
name: toy
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: {frames}
frame_rate_hz: 10
axes:
  weather:
    dry: {{weather: dry}}
    snow-3: {{weather: snow, precipitation_mm_h: 3, snow_accumulation_h: 1}}
  road:
    flat: {{initial_speed_km_h: 40, peak_pressure_mpa: 2.3, brake_onset_s: 0.2}}
    hump: {{initial_speed_km_h: 40, hazard_center_m: 4, hazard_length_m: 3.7, hazard_height_m: 0.075}}
"""


def write_toy_grid(folder: Path, grid: str = TOY_GRID, *, seed: int = 1, **fields: object) -> str:
    """Path of a ``grid.yaml`` in a folder, beside the scene and camera that it names."""
    write_scene(toy_street(seed), folder / "scene", {})
    (folder / "camera.yaml").write_text(TOY_CAMERA)
    path = folder / "grid.yaml"
    path.write_text(grid.format(folder=folder, **fields))
    return str(path)


def toy_street(seed: int = 1) -> Scene:
    """A flat speckled road 60 m long between two speckled walls, with a straight route of 40 m along it."""
    draw = np.random.Generator(np.random.Philox(seed))
    grid_x, grid_y = np.meshgrid(np.arange(-5, 60, 0.25), np.arange(-4, 4.01, 0.25), indexing="ij")
    road = np.stack([grid_x.ravel(), grid_y.ravel(), np.zeros(grid_x.size)], axis=1)
    wall_x, wall_z = np.meshgrid(np.arange(-5, 60, 0.4), np.arange(0.2, 4, 0.4), indexing="ij")
    walls = [
        np.stack([wall_x.ravel(), np.full(wall_x.size, side), wall_z.ravel()], axis=1) for side in (-4.2, 4.2)
    ]
    means = np.concatenate([road, *walls]).astype(np.float32)
    is_road = np.arange(len(means)) < len(road)
    normals = np.where(
        is_road[:, None], [0, 0, 1], np.stack([0 * means[:, 1], -np.sign(means[:, 1]), 0 * means[:, 1]], 1)
    )
    brightness = np.where(is_road, 0.12, 0.35)[:, None] * draw.uniform(0.3, 1.7, (len(means), 1))
    colour = brightness * np.where(is_road[:, None], [1, 1, 1.05], [1.1, 0.9, 0.7])
    thin, wide = 0.01, np.where(is_road, 0.15, 0.24)
    scales = np.stack([wide, np.where(is_road, wide, thin), np.where(is_road, thin, wide)], axis=1)
    station = np.linspace(0, 40, 41)
    poses = np.tile(np.eye(4), (41, 1, 1))
    poses[:, 0, 3] = station
    return Scene(
        name="toy",
        gaussians=Gaussians(
            means=means,
            quats_wxyz=np.tile(np.array([1, 0, 0, 0], np.float32), (len(means), 1)),
            scales=scales.astype(np.float32),
            opacities=np.full(len(means), 0.95, np.float32),
            sh=((colour - 0.5) / 0.28209479177387814).astype(np.float32)[:, None, :],
            normals=normals.astype(np.float32),
            class_id=np.where(is_road, SemanticClass.ROAD, SemanticClass.BUILDING).astype(np.uint8),
        ),
        route=Route(station=station, T_world_rig=poses),
        environment=np.full((16, 32, 3), 0.6, np.float32),
        carriageway_left=4.0,
        carriageway_right=-4.0,
    )
