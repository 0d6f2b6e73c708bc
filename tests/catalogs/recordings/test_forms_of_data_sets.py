"""VBOX files, nuScenes' CAN bus messages, KITTI's OXTS packets, and MDF groups give the signals that they state."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogs.recordings import read_signals, recording_files, stored_files, summarise_signals
from tasks.errors import InputError
from tests.catalogs.recordings.written import make_map, take_speed

VBO = """File created on 04/08/2026 at 13:16:03

[header]
satellites
time
velocity kmh
Brake Pressure

[channel units]
bar

[column names]
sats time velocity Brake_Pressure

[data]
008 235959.90 +080.000 +1.5
008 235959.95 +079.500 +2.5
008 000000.00 +079.000 +3.5
"""


def test_a_vbox_file_has_its_own_clock_names_and_units(tmp_path: Path) -> None:
    (tmp_path / "log.vbo").write_text(VBO, newline="\r\n")
    channels = {
        "speed": {"source": "velocity"},
        "brake_pressure": {"source": "Brake_Pressure", "unit": "bar"},
    }
    found = read_signals(tmp_path / "log.vbo", make_map(channels, time=None))
    np.testing.assert_allclose(found["velocity"].time, [86399.9, 86399.95, 86400.0], rtol=0, atol=1e-9)
    assert (found["velocity"].values.tolist(), found["velocity"].unit) == ([80.0, 79.5, 79.0], "kmh")
    assert found["Brake_Pressure"].unit == "bar"
    assert [row.signal for row in summarise_signals(tmp_path / "log.vbo", None)] == [
        "sats", "time", "velocity", "Brake_Pressure",
    ]  # fmt: skip
    (tmp_path / "log.vbo").write_text(VBO.replace("sats", "velocity"))
    with pytest.raises(InputError, match=r"stands 2 times: .* velocity#1, velocity#2"):
        read_signals(tmp_path / "log.vbo", make_map(channels, time=None))
    (tmp_path / "log.vbo").write_text(VBO.replace("[data]", ""))
    with pytest.raises(InputError, match="must have the sections"):
        read_signals(tmp_path / "log.vbo", take_speed("velocity"))


def test_messages_of_nuscenes_are_signals_and_a_scene_is_one_recording(tmp_path: Path) -> None:
    monitor = [{"utime": 1_000_000 + 500_000 * k, "vehicle_speed": 30.0 - k, "brake": k} for k in range(3)]
    pose = [{"utime": 1_000_000 + 20_000 * k, "accel": [-1.0, 0.0, 9.8]} for k in range(3)]
    for kind, rows in (("vehicle_monitor", monitor), ("pose", pose), ("meta", {"pose": {"freq": 50}})):
        (tmp_path / f"scene-0001_{kind}.json").write_text(json.dumps(rows))
    (scene,) = recording_files(tmp_path)
    assert len(stored_files(scene)) == 3
    found = read_signals(scene, make_map({"speed": {"source": "vehicle_speed"},
                                          "longitudinal_acceleration": {"source": "pose.accel[0]"}}))  # fmt: skip
    assert found["vehicle_speed"].time.tolist() == [1.0, 1.5, 2.0] and found["vehicle_speed"].unit == "km/h"
    assert found["pose.accel[0]"].values.tolist() == [-1.0] * 3
    alone = read_signals(tmp_path / "scene-0001_vehicle_monitor.json", take_speed("vehicle_speed"))
    assert alone["vehicle_speed"].values.tolist() == [30.0, 29.0, 28.0]


def write_drive(folder: Path, packets: list[int]) -> None:
    (folder / "oxts" / "data").mkdir(parents=True)
    stamps = "".join(f"2011-09-26 13:02:00.{50_000_000 * k:09d}\n" for k in range(4))
    (folder / "oxts" / "timestamps.txt").write_text(stamps)
    for k in packets:
        (folder / "oxts" / "data" / f"{k:010d}.txt").write_text(" ".join(str(100 * k + n) for n in range(30)))


def test_a_drive_of_kitti_is_read_by_its_folder(tmp_path: Path) -> None:
    write_drive(tmp_path / "drive", [0, 1, 3])
    for source in (tmp_path / "drive", tmp_path / "drive" / "oxts"):
        assert recording_files(source) == (source,)
        found = read_signals(source, take_speed("vf", time=None))["vf"]
        np.testing.assert_allclose(found.time, 46920.0 + np.array([0.0, 0.05, 0.15]), rtol=0, atol=1e-9)
        assert (found.values.tolist(), found.unit) == ([8.0, 108.0, 308.0], "m/s")
    assert recording_files(tmp_path) == (tmp_path / "drive",)
    with pytest.raises(InputError, match="signal Speed is missing; there are: lat"):
        read_signals(tmp_path / "drive", take_speed("Speed"))
    (tmp_path / "drive" / "oxts" / "data" / "0000000009.txt").write_text("1")
    with pytest.raises(InputError, match=r"0000000009.txt has none among the 4 lines"):
        read_signals(tmp_path / "drive", take_speed("vf"))


class Group:
    """A group of channels as asammdf has it."""

    def __init__(self, comment: str):
        self.channel_group = type("Header", (), {"acq_name": "", "comment": comment})


class Recording:
    """What of an open MDF file is asked for: one name in two groups, and a table of values."""

    def __init__(self) -> None:
        self.channels_db = {"time": ((0, 0), (1, 0)), "v": ((0, 1), (1, 1)), "switch": ((0, 2),)}
        self.masters_db = {0: 0, 1: 0}
        self.groups = [Group("CAN1 ESP_01"), Group("CAN2 GPS_01")]

    def get(self, group: int, index: int) -> Any:
        values = np.array([b"released", b"pressed"]) if index == 2 else np.array([10.0 + group, 9.0 + group])
        return type("Channel", (), {"timestamps": np.array([0.0, 1.0]), "samples": values, "unit": "km/h"})


def test_a_name_in_two_groups_of_mdf_is_given_by_its_group(monkeypatch: pytest.MonkeyPatch) -> None:
    from catalogs.recordings import mdf

    monkeypatch.setattr(mdf, "_open_recording", lambda path, use: use(Recording()))
    path = Path("log.mf4")
    with pytest.raises(InputError, match=r"v stands 2 times: .* ESP_01.v, GPS_01.v"):
        mdf.read_mdf(path, take_speed("v"))
    for name in ("GPS_01.v", "1.v", "group 1.v", "CAN2 GPS_01.v"):
        assert mdf.read_mdf(path, take_speed(name))[name].values.tolist() == [11.0, 10.0]
    assert [row.signal for row in mdf.summarise_mdf(path, None)] == ["ESP_01.v", "GPS_01.v", "switch"]
    with pytest.raises(InputError, match=r"'released': .* values: \{\"released\": 1, \"pressed\": 1\}"):
        mdf.read_mdf(path, take_speed("switch"))
    values = {"speed": {"source": "switch", "unit": "m/s", "values": {"released": 0, "pressed": 1}}}
    assert mdf.read_mdf(path, make_map(values))["switch"].values.tolist() == [0.0, 1.0]
