"""Sound files of measuring and of other tools, small and cheap: campaigns, recordings, clouds, routes, videos."""

import csv
import io
import json
import shutil
from pathlib import Path
from typing import Any

import cv2
import gaussforge
import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import yaml
from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_typestore
from scipy.io import savemat

from catalogs.scenes.gaussian_files import write_gaussians
from studies.fuzzing.sound import CATALOGUE, small_scene, write_file
from tasks.campaign.campaign import CHANNELS
from tasks.campaign.channels import MAIN_CHANNELS


def make_stop(samples: int = 120, rate: float = 100.0, seed: int = 5) -> dict[str, np.ndarray]:
    """Measured columns of one stop, with a little noise that the seed decides."""
    draw = np.random.default_rng(seed)
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


def write_campaign(folder: Path) -> None:
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
    write_file(folder / "0" / "campaign.yaml", yaml.safe_dump(header).encode())
    write_file(folder / "0" / "runs.csv", _format_csv([{"run": name, **row} for name in names]))
    for seed, name in enumerate(names):
        write_file(folder / "0" / "runs" / f"{name}.parquet", _format_parquet(make_stop(seed=seed)))


def write_recordings(folder: Path) -> None:
    """A log of each form with its channel map."""
    from catalogs.recordings import SUFFIXES

    columns = make_stop()
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
    forms = {"csv": _format_csv(rows), "parquet": _format_parquet(columns), "json": json.dumps(bus).encode()}
    assert {f".{form}" for form in forms} <= set(SUFFIXES)
    for form, content in forms.items():
        write_file(folder / form / f"log.{form}", content)
        write_file(folder / form / "map.yaml", yaml.safe_dump(channel_map).encode())


def write_matlab_recordings(folder: Path) -> None:
    """A struct of vectors as MATLAB 5, 7 and 7.3 write it, with its channel map."""
    columns = make_stop()
    for name in ("v5", "v7", "v73"):
        (folder / name).mkdir(parents=True)
        write_file(folder / name / "map.yaml", _map_speed("log.speed"))
    savemat(folder / "v5" / "log.mat", {"log": columns})
    savemat(folder / "v7" / "log.mat", {"log": columns, "t": columns["time"]}, do_compression=True)
    with h5py.File(folder / "v73" / "log.mat", "w", userblock_size=512) as file:
        group = file.create_group("log")
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, values in columns.items():
            group.create_dataset(name, data=values[None, :], compression="gzip")


def write_bags(folder: Path) -> None:
    """Messages with and without a header in a ROS 1 bag, a ROS 2 database and MCAP files, with their channel map."""
    columns = make_stop()
    store = get_typestore(Stores.ROS2_HUMBLE)
    number, wrench = store.types["std_msgs/msg/Float64"], store.types["geometry_msgs/msg/AccelStamped"]
    header, stamp = store.types["std_msgs/msg/Header"], store.types["builtin_interfaces/msg/Time"]
    accel, vector = store.types["geometry_msgs/msg/Accel"], store.types["geometry_msgs/msg/Vector3"]
    for form in ("bag", "db3", "mcap", "zstd"):
        name = "mcap" if form == "zstd" else form
        path = folder / form / f"log.{name}"
        path.parent.mkdir(parents=True)
        if form == "bag":
            bag: Any = rosbag1.Writer(path)
            bag.set_compression(rosbag1.Writer.CompressionFormat.LZ4)
        else:
            plugin = rosbag2.StoragePlugin.SQLITE3 if form == "db3" else rosbag2.StoragePlugin.MCAP
            bag = rosbag2.Writer(path.parent / "made", version=9, storage_plugin=plugin)
        if form == "zstd":
            bag.set_compression(rosbag2.CompressionMode.STORAGE, rosbag2.CompressionFormat.ZSTD)
        pack = store.serialize_ros1 if form == "bag" else store.serialize_cdr
        with bag:
            speeds = bag.add_connection("/speed", number.__msgtype__, typestore=store)
            motions = bag.add_connection("/motion", wrench.__msgtype__, typestore=store)
            for t, v, a in zip(
                columns["time"], columns["speed"], columns["longitudinal_acceleration"], strict=True
            ):
                log_time = 10**18 + round(t * 1e9)
                bag.write(speeds, log_time, pack(number(v), number.__msgtype__))
                zero = vector(0.0, 0.0, 0.0)
                when = header(stamp(log_time // 10**9, log_time % 10**9), "car")
                motion = wrench(when, accel(vector(a, 0.0, 9.81), zero))
                bag.write(motions, log_time, pack(motion, wrench.__msgtype__))
        if form != "bag":
            (path.parent / "made" / f"made.{name}").rename(path)
            shutil.rmtree(path.parent / "made")
        write_file(path.parent / "map.yaml", _map_speed("/speed.data", "/motion.accel.linear.x"))


def _map_speed(speed: str, acceleration: str | None = None) -> bytes:
    """A channel map of speed, and of acceleration where there is one."""
    channel_map = yaml.safe_load((CATALOGUE / "channel_maps" / "bmw-m8.yaml").read_text())
    channels = {"speed": {"source": speed, "unit": "m/s"}}
    if acceleration is not None:
        channels["longitudinal_acceleration"] = {"source": acceleration, "unit": "m/s^2"}
    missing = [channel.name for channel in MAIN_CHANNELS if channel.name not in channels]
    channel_map |= {
        "channels": channels, "not_measured": missing,
        "time": {"source": "time", "unit": "s"}, "runs": [],
    }  # fmt: skip
    return yaml.safe_dump(channel_map).encode()


def write_references(folder: Path) -> None:
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
        write_file(folder / "0" / f"{name}.parquet", _format_parquet(trace))
    write_file(
        folder / "0" / "cases.json", json.dumps([{"case": name} | case for name in ("a", "b")]).encode()
    )


def gaussian_files(folder: Path) -> None:
    """One cloud in every format."""
    folder.mkdir(parents=True, exist_ok=True)
    cloud = small_scene().gaussians
    write_gaussians(cloud, folder / "plain.ply")
    plain = (folder / "plain.ply").read_bytes()
    (folder / "plain.ply").unlink()
    write_file(folder / "ply" / "cloud.ply", plain)
    for form in ("compressed.ply", "splat", "spz"):
        write_file(
            folder / form / f"cloud.{form}", gaussforge.GaussForge().convert(plain, "ply", form)["data"]
        )


def write_import(folder: Path) -> None:
    """A cloud with a route of the same frame."""
    write_file(folder / "0" / "route.txt", trajectory_text().encode())
    write_gaussians(small_scene().gaussians, folder / "0" / "cloud.ply")


def write_routes(folder: Path) -> None:
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
        write_file(folder / name, text.encode())


def trajectory_text() -> str:
    """A straight trajectory as TUM writes it."""
    return "# time x y z qx qy qz qw\n" + "\n".join(
        f"{k / 10:.2f} 0 0 {k * 1.2:.1f} 0 0 0 1" for k in range(6)
    )


def stereo_folders(folder: Path) -> None:
    """A posed stereo sequence of four pictures."""
    rows = ["700 0 6 0 0 700 4 0 0 0 1 0", "700 0 6 -350 0 700 4 0 0 0 1 0"]
    write_file(folder / "0" / "calib.txt", "\n".join(rows).encode())
    write_file(
        folder / "0" / "poses.txt", "\n".join(f"1 0 0 0 0 1 0 0 0 0 1 {k / 2}" for k in range(4)).encode()
    )
    for side in ("image_l", "image_r"):
        for k in range(4):
            picture = np.full((8, 12, 3), 40 * k, np.uint8)
            write_file(folder / "0" / side / f"{k:06d}.png", cv2.imencode(".png", picture)[1].tobytes())


def write_videos(folder: Path) -> None:
    """Eight frames in two codecs."""
    draw = np.random.default_rng(3)
    for ending, codec in (("mp4", "mp4v"), ("avi", "MJPG")):
        path = folder / ending / f"video.{ending}"
        path.parent.mkdir(parents=True)
        writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*codec), 10.0, (48, 32))
        for _ in range(8):
            writer.write(draw.integers(0, 255, (32, 48, 3), dtype=np.uint8))
        writer.release()


def write_claims(folder: Path) -> None:
    """Claimed motion of a video, by station and by speed."""
    t = np.arange(20) * 0.05
    by_station = {"time": t, "pitch": 0.01 * t, "station": 10 * t}
    by_speed = {"t_ns": (t * 1e9).astype(np.int64), "pitch": 0.01 * t, "speed": 10 + t}
    for name, columns in (("station", by_station), ("speed", by_speed)):
        write_file(folder / name / "claim.parquet", _format_parquet(columns))


def _format_csv(rows: list[dict[str, Any]]) -> bytes:
    out = io.StringIO()
    writer = csv.DictWriter(out, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return out.getvalue().encode()


def _format_parquet(columns: dict[str, np.ndarray]) -> bytes:
    out = io.BytesIO()
    pq.write_table(pa.table(columns), out)
    return out.getvalue()
