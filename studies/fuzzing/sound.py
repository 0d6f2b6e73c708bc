"""Sound catalogue entries, grids, scenes, datasets and frozen runs, small and cheap, from which mutations start."""

import json
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from unittest.mock import patch

import numpy as np
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat, PublicFormat

import catalogs
from catalogs.scenes.folder import write_scene
from flows.auditing.signing import sign_dataset
from flows.making import generate as making
from manifests.frozen_run import seal_run
from tasks.conventions import SemanticClass
from tasks.errors import InputError
from tasks.scene.gaussians import Gaussians
from tasks.scene.route import Route
from tasks.scene.scene import Scene

CATALOGUE = Path(catalogs.__file__).parent
Writer = Callable[[Path], None]
"""Writes sound documents, each in a folder of its own below the one that it is given."""

GRID = """
name: small
scene: {scene}
pictures: false
frames: 3
frame_rate_hz: 10
axes:
  weather:
    dry: {{weather: dry}}
    snow-3: {{weather: snow, precipitation_mm_h: 3, snow_accumulation_h: 1}}
  road:
    flat: {{initial_speed_km_h: 40, peak_pressure_mpa: 2.3, brake_onset_s: 0.2}}
    hump: {{initial_speed_km_h: 40, hazard_center_m: 4, hazard_length_m: 3.7, hazard_height_m: 0.075}}
splits:
  train: {{weather: dry}}
  held_out: {{}}
"""
WAYS = """
name: ways
scene: street
frames: 5
exclude:
  - {weather: snow, initial_speed_km_h: {min: 50}}
base: {weather: rain, precipitation_mm_h: 5, peak_pressure_mpa: 2}
zip:
  speed: {slow: {initial_speed_km_h: 30}, fast: {initial_speed_km_h: 60}}
  onset: {early: {brake_onset_s: 0.1}, late: {brake_onset_s: 0.3}}
scenarios:
  a: {hazard_center_m: 10, hazard_length_m: 3.7, hazard_height_m: 0.05}
  b: {weather: snow, snow_accumulation_h: 2}
latin_hypercube: {count: 4, seed: 7, ranges: {precipitation_mm_h: [1, 20], peak_pressure_mpa: [1, 3]}}
"""


def small_scene() -> Scene:
    """Sixty Gaussians along a straight route of 40 m."""
    draw = np.random.Generator(np.random.Philox(1))
    means = np.stack([np.linspace(0, 40, 60), np.tile([-2, 0, 2], 20), np.zeros(60)], axis=1)
    poses = np.tile(np.eye(4), (41, 1, 1))
    poses[:, 0, 3] = np.arange(41)
    gaussians = Gaussians(
        means=means.astype(np.float32),
        quats_wxyz=np.tile(np.array([1, 0, 0, 0], np.float32), (60, 1)),
        scales=np.full((60, 3), (0.2, 0.2, 0.01), np.float32),
        opacities=np.full(60, 0.9, np.float32),
        sh=draw.normal(0, 0.2, (60, 4, 3)).astype(np.float32),
        normals=np.tile(np.array([0, 0, 1], np.float32), (60, 1)),
        class_id=np.full(60, SemanticClass.ROAD, np.uint8),
        display_encoded=True,
    )
    return Scene(
        name="small",
        gaussians=gaussians,
        route=Route(station=np.arange(41.0), T_world_rig=poses),
        environment=np.full((4, 8, 3), 0.6, np.float32),
        carriageway_left=4.0,
        carriageway_right=-4.0,
        sun_direction_deg=(120.0, 40.0),
    )


def copy_entries(pattern: str, name: str = "entry.yaml") -> Writer:
    """A writer of the catalogue files of one kind, each as the file of this name."""

    def write(folder: Path) -> None:
        for path in sorted(CATALOGUE.glob(pattern)):
            write_file(folder / path.stem / name, path.read_bytes())

    return write


def write_texts(*variants: dict[str, str]) -> Writer:
    """A writer of documents given as text: file name to content."""

    def write(folder: Path) -> None:
        for number, variant in enumerate(variants):
            for name, text in variant.items():
                write_file(folder / str(number) / name, text.encode())

    return write


def write_weather(folder: Path) -> None:
    for path in sorted((CATALOGUE / "weather").glob("*.yaml")):
        write_file(folder / "0" / path.name, path.read_bytes())


def write_grids(folder: Path) -> None:
    copy_entries("grids/*.yaml", "grid.yaml")(folder)
    write_file(folder / "ways" / "grid.yaml", WAYS.encode())


def planned_grids(folder: Path) -> None:
    write_file(folder / "0" / "grid.yaml", _grid_beside(folder).read_bytes())


def scene_folders(folder: Path) -> None:
    write_scene(small_scene(), folder / "0", {"held_out_psnr_db": 21.5})


def write_dataset(folder: Path) -> None:
    """A finished dataset without pictures."""
    making.generate_dataset(str(_grid_beside(folder)), str(folder / "0"), runner="threads", workers=1)


def signed_dataset(folder: Path) -> None:
    """A finished dataset with a signature, and the key that made it."""
    write_dataset(folder)
    key = Ed25519PrivateKey.from_private_bytes(bytes(range(32)))
    private = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    public = key.public_key().public_bytes(Encoding.PEM, PublicFormat.SubjectPublicKeyInfo)
    write_file(folder.parent / "key.pem", private)
    sign_dataset(str(folder / "0"), key=str(folder.parent / "key.pem"))
    write_file(folder / "0" / "public.pem", public)


def unfinished_dataset(folder: Path) -> None:
    """A dataset whose clips are made and not sealed."""
    with patch.object(making, "seal_dataset", side_effect=InputError("stopped")), suppress(InputError):
        making.generate_dataset(str(_grid_beside(folder)), str(folder / "0"), runner="threads", workers=1)


def _grid_beside(folder: Path) -> Path:
    outside = folder.parent / "inputs"
    if not outside.is_dir():
        write_scene(small_scene(), outside / "scene", {})
        (outside / "grid.yaml").write_text(GRID.format(scene=outside / "scene"))
    return outside / "grid.yaml"


def frozen_runs(folder: Path) -> None:
    """The first clips of a frozen run that ships, sealed anew."""
    for name in ("demo", "replay"):
        run = json.loads((CATALOGUE.parent / "manifests" / "frozen" / f"{name}.json").read_bytes())
        run = {key: value for key, value in run.items() if key not in {"format", "seal"}}
        run["clips"] = run["clips"][:2]
        write_file(folder / name / "run.json", json.dumps(seal_run(run)).encode())


def write_file(path: Path, content: bytes) -> None:
    """Write a file and the folders above it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
