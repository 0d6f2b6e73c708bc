"""Sound documents of every parser, small and cheap: what the mutations start from."""

import csv
import io
import json
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any
from unittest.mock import patch

import cv2
import gaussforge
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import yaml
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat, PublicFormat

import catalogs
from catalogs.scenes.folder import write_scene
from catalogs.scenes.gaussian_files import write_gaussians
from flows.auditing.signing import sign
from flows.making import generate as making
from manifests.frozen_run import sealed
from tasks.closure.campaign import CHANNELS
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


def entries(pattern: str, name: str = "entry.yaml") -> Writer:
    """A writer of the catalogue files of one kind, each as the file of this name."""

    def write(folder: Path) -> None:
        for path in sorted(CATALOGUE.glob(pattern)):
            _put(folder / path.stem / name, path.read_bytes())

    return write


def texts(*variants: dict[str, str]) -> Writer:
    """A writer of documents given as text: file name to content."""

    def write(folder: Path) -> None:
        for number, variant in enumerate(variants):
            for name, text in variant.items():
                _put(folder / str(number) / name, text.encode())

    return write


def weather(folder: Path) -> None:
    for path in sorted((CATALOGUE / "weather").glob("*.yaml")):
        _put(folder / "0" / path.name, path.read_bytes())


def grids(folder: Path) -> None:
    entries("grids/*.yaml", "grid.yaml")(folder)
    _put(folder / "ways" / "grid.yaml", WAYS.encode())


def planned_grids(folder: Path) -> None:
    _put(folder / "0" / "grid.yaml", _grid_beside(folder).read_bytes())


def scene_folders(folder: Path) -> None:
    write_scene(small_scene(), folder / "0", {"held_out_psnr_db": 21.5})


def dataset(folder: Path) -> None:
    """A finished dataset without pictures."""
    making.generate(str(_grid_beside(folder)), str(folder / "0"), runner="threads", workers=1)


def signed_dataset(folder: Path) -> None:
    """A finished dataset with a signature, and the key that made it."""
    dataset(folder)
    key = Ed25519PrivateKey.from_private_bytes(bytes(range(32)))
    private = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    public = key.public_key().public_bytes(Encoding.PEM, PublicFormat.SubjectPublicKeyInfo)
    _put(folder.parent / "key.pem", private)
    sign(str(folder / "0"), key=str(folder.parent / "key.pem"))
    _put(folder / "0" / "public.pem", public)


def unfinished_dataset(folder: Path) -> None:
    """A dataset whose clips are made and not sealed."""
    with patch.object(making, "seal", side_effect=InputError("stopped")), suppress(InputError):
        making.generate(str(_grid_beside(folder)), str(folder / "0"), runner="threads", workers=1)


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
        _put(folder / name / "run.json", json.dumps(sealed(run)).encode())


def braking(samples: int = 120, rate: float = 100.0) -> dict[str, np.ndarray]:
    """Measured columns of one stop, with a little noise."""
    draw = np.random.default_rng(5)
    t = np.arange(samples) / rate
    pressure = np.clip((t - 0.3) / 0.3, 0.0, 1.0) * 1.5
    acceleration = -2.0 * pressure
    speed = 20.0 + np.cumsum(acceleration) / rate
    pitch = 0.4 * pressure
    clean = {
        "brake_pressure": pressure, "speed": speed, "longitudinal_acceleration": acceleration,
        "wheel_speed_front": speed / 0.32, "wheel_speed_rear": speed / 0.32, "pitch": pitch,
        "pitch_rate": np.gradient(pitch, t), "vertical_acceleration": np.zeros(samples),
    }  # fmt: skip
    assert set(CHANNELS) <= set(clean)
    return {
        "time": t,
        **{name: values + 0.01 * draw.standard_normal(samples) for name, values in clean.items()},
    }


def campaigns(folder: Path) -> None:
    """A campaign of six runs."""
    names = [f"run-{k}" for k in range(6)]
    tolerances: dict[str, Any] = dict.fromkeys(
        ("pressure_gain", "mass", "pitch_gain", "wheel_radius", "suspension_damping", "suspension_stiffness", "grade"),
        0.02,
    )  # fmt: skip
    tolerances["run"] = dict.fromkeys(
        ("initial_speed_m_s", "friction", "acceleration_bias_m_s2", "pitch_offset_deg"), 0.03
    )
    header = {
        "campaign": "small", "vehicle": "paper-reference", "sample_rate_hz": 100,
        "split": {"train": names[:3], "held_out": names[3:]}, "tolerances_1sigma": tolerances,
    }  # fmt: skip
    row = {
        "weather": "dry", "precipitation_mm_h": 0.0, "snow_accumulation_h": 0.0, "direction": 1,
        "disc_temperature_above_ambient_c": 20.0, "hazard_center_m": 0.0, "hazard_length_m": 0.0,
        "hazard_height_m": 0.0,
    }  # fmt: skip
    _put(folder / "0" / "campaign.yaml", yaml.safe_dump(header).encode())
    _put(folder / "0" / "runs.csv", _csv([{"run": name, **row} for name in names]))
    for name in names:
        _put(folder / "0" / "runs" / f"{name}.parquet", _parquet(braking()))


def recordings(folder: Path) -> None:
    """A log of each form with its channel map."""
    from catalogs.recordings import SUFFIXES

    columns = braking()
    units = {
        "brake_pressure": "MPa", "speed": "m/s", "longitudinal_acceleration": "m/s^2", "wheel_speed_front": "rad/s",
        "wheel_speed_rear": "rad/s", "pitch": "deg", "pitch_rate": "deg/s", "vertical_acceleration": "m/s^2",
    }  # fmt: skip
    channel_map = yaml.safe_load((CATALOGUE / "channel_maps" / "bmw-m8.yaml").read_text())
    channel_map |= {
        "channels": {name: {"source": name, "unit": unit} for name, unit in units.items()}, "not_measured": [],
        "time": {"source": "time", "unit": "s"}, "runs": [], "segment": None, "conditions": {},
    }  # fmt: skip
    rows = [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]
    bus = {
        name: {"unit": units[name], "values": [[t, v] for t, v in zip(columns["time"], values, strict=True)]}
        for name, values in columns.items() if name != "time"
    }  # fmt: skip
    forms = {"csv": _csv(rows), "parquet": _parquet(columns), "json": json.dumps(bus).encode()}
    assert {f".{form}" for form in forms} <= set(SUFFIXES)
    for form, content in forms.items():
        _put(folder / form / f"log.{form}", content)
        _put(folder / form / "map.yaml", yaml.safe_dump(channel_map).encode())


def references(folder: Path) -> None:
    """Two reference traces with their conditions."""
    case = {
        "split": "development", "weather": "dry", "surface_coefficient": 0.8, "initial_speed_km_h": 40.0,
        "peak_pressure_mpa": 2.3, "ramp_s": 0.5, "brake_onset_s": 0.3,
    }  # fmt: skip
    t = np.arange(50) * 0.01
    wheels = {f"{name}_{w}": np.full(50, v) for name, v in (("slip", 0.1), ("wheel_load", 4e3))
              for w in ("fl", "fr", "rl", "rr")}  # fmt: skip
    trace = {"time": t, "station": 10 * t, "speed": 11 - t, "pitch": 0.1 * t, **wheels}
    for name in ("a", "b"):
        _put(folder / "0" / f"{name}.parquet", _parquet(trace))
    _put(folder / "0" / "cases.json", json.dumps([{"case": name} | case for name in ("a", "b")]).encode())


def gaussian_files(folder: Path) -> None:
    """One cloud in every format."""
    folder.mkdir(parents=True, exist_ok=True)
    cloud = small_scene().gaussians
    write_gaussians(cloud, folder / "plain.ply")
    plain = (folder / "plain.ply").read_bytes()
    (folder / "plain.ply").unlink()
    _put(folder / "ply" / "cloud.ply", plain)
    for form in ("compressed.ply", "splat", "spz"):
        _put(folder / form / f"cloud.{form}", gaussforge.GaussForge().convert(plain, "ply", form)["data"])


def imports(folder: Path) -> None:
    """A cloud with a route of the same frame."""
    _put(folder / "0" / "route.txt", trajectory_text().encode())
    write_gaussians(small_scene().gaussians, folder / "0" / "cloud.ply")


def routes(folder: Path) -> None:
    """A straight route in every form."""
    poses = np.tile(np.eye(4), (6, 1, 1))
    poses[:, 2, 3] = np.arange(6) * 1.2
    kitti = "\n".join(" ".join(f"{v:.9e}" for v in pose[:3].ravel()) for pose in poses)
    frames = [{"file_path": f"{k}.png", "transform_matrix": (p @ np.diag([1, -1, -1, 1])).tolist()}
              for k, p in enumerate(poses)]  # fmt: skip
    attitudes = "x,y,z,qw,qx,qy,qz\n" + "\n".join(f"{k},0,0,1,0,0,0" for k in range(6))
    documents = {
        "points/route.csv": "x,y,z\n" + "\n".join(f"{k},0,0" for k in range(6)),
        "attitudes/route.csv": attitudes,
        "kitti/route.txt": kitti,
        "tum/route.txt": trajectory_text(),
        "nerfstudio/route.json": json.dumps({"camera_model": "OPENCV", "frames": frames}),
    }
    for name, text in documents.items():
        _put(folder / name, text.encode())


def trajectory_text() -> str:
    """A straight trajectory as TUM writes it."""
    return "# time x y z qx qy qz qw\n" + "\n".join(
        f"{k / 10:.2f} 0 0 {k * 1.2:.1f} 0 0 0 1" for k in range(6)
    )


def stereo_folders(folder: Path) -> None:
    """A posed stereo sequence of four pictures."""
    rows = ["700 0 6 0 0 700 4 0 0 0 1 0", "700 0 6 -350 0 700 4 0 0 0 1 0"]
    _put(folder / "0" / "calib.txt", "\n".join(rows).encode())
    _put(folder / "0" / "poses.txt", "\n".join(f"1 0 0 0 0 1 0 0 0 0 1 {k / 2}" for k in range(4)).encode())
    for side in ("image_l", "image_r"):
        for k in range(4):
            picture = np.full((8, 12, 3), 40 * k, np.uint8)
            _put(folder / "0" / side / f"{k:06d}.png", cv2.imencode(".png", picture)[1].tobytes())


def videos(folder: Path) -> None:
    """Eight frames in two codecs."""
    draw = np.random.default_rng(3)
    for ending, codec in (("mp4", "mp4v"), ("avi", "MJPG")):
        path = folder / ending / f"video.{ending}"
        path.parent.mkdir(parents=True)
        writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*codec), 10.0, (48, 32))
        for _ in range(8):
            writer.write(draw.integers(0, 255, (32, 48, 3), dtype=np.uint8))
        writer.release()


def claims(folder: Path) -> None:
    """Claimed motion of a video, by station and by speed."""
    t = np.arange(20) * 0.05
    by_station = {"time": t, "pitch": 0.01 * t, "station": 10 * t}
    by_speed = {"t_ns": (t * 1e9).astype(np.int64), "pitch": 0.01 * t, "speed": 10 + t}
    for name, columns in (("station", by_station), ("speed", by_speed)):
        _put(folder / name / "claim.parquet", _parquet(columns))


def _put(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)


def _csv(rows: list[dict[str, Any]]) -> bytes:
    out = io.StringIO()
    writer = csv.DictWriter(out, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return out.getvalue().encode()


def _parquet(columns: dict[str, np.ndarray]) -> bytes:
    out = io.BytesIO()
    pq.write_table(pa.table(columns), out)
    return out.getvalue()
