"""Recordings written by the libraries' own writers: MATLAB 5 and 7.3 files, ROS bags and MCAP."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from catalogs.channel_maps import ChannelMap
from tests.campaign.recorded import MAP

CAR = """std_msgs/Header header
float64 speed
float32[4] wheels
int16[] counts
geometry_msgs/Vector3 acceleration
string note
bool braking
"""
FORMS = ("bag", "db3", "mcap", "folder")


def make_map(channels: Mapping[str, Any], **changes: Any) -> ChannelMap:
    """A channel map of these channels, whose other rules are of no matter."""
    import yaml

    content = yaml.safe_load(MAP)
    missing = [name for name in content["channels"] if name not in channels]
    return ChannelMap.model_validate(content | {"channels": channels, "not_measured": missing} | changes)


def take_speed(source: str, **changes: Any) -> ChannelMap:
    return make_map({"speed": {"source": source, "unit": "m/s"}}, **changes)


def write_hdf(path: Path, variables: Mapping[str, Any]) -> None:
    """A file as MATLAB 7.3 writes it: 512 bytes of its own, dimensions reversed, classes as attributes."""
    with h5py.File(path, "w", userblock_size=512) as file:
        _fill_group(file, file, variables)
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def _fill_group(file: h5py.File, group: h5py.Group, variables: Mapping[str, Any]) -> None:
    for name, value in variables.items():
        if isinstance(value, list):  # an array of structs: each field holds references to its elements
            elements = group.create_group(name)
            elements.attrs["MATLAB_class"] = np.bytes_("struct")
            for field in value[0]:
                places = elements.create_dataset(field, (len(value), 1), dtype=h5py.ref_dtype)
                for k, element in enumerate(value):
                    stored = file.create_dataset(
                        f"#refs#/{name}{field}{k}", data=np.atleast_2d(element[field])
                    )
                    stored.attrs["MATLAB_class"] = np.bytes_("double")
                    places[k, 0] = stored.ref
        elif isinstance(value, Mapping):
            inner = group.create_group(name)
            inner.attrs["MATLAB_class"] = np.bytes_("struct")
            _fill_group(file, inner, value)
        elif isinstance(value, str):
            stored = group.create_dataset(name, data=np.array([[ord(c)] for c in value], np.uint16))
            stored.attrs["MATLAB_class"] = np.bytes_("char")
        else:
            stored = group.create_dataset(name, data=np.atleast_2d(value).T)
            stored.attrs["MATLAB_class"] = np.bytes_("double")


def make_store() -> Any:
    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg(CAR, "cars/msg/Car"))
    return store


def write_bag(folder: Path, form: str, messages: Iterable[tuple[str, int, Any]], store: Any = None) -> Path:
    """A recording of messages: topic, log time [ns], and a message of the store."""
    store = store or make_store()
    if form == "bag":
        path = folder / "log.bag"
        with rosbag1.Writer(path) as bag:
            _write_messages(bag, messages, store, store.serialize_ros1)
        return path
    plugin = rosbag2.StoragePlugin.MCAP if form == "mcap" else rosbag2.StoragePlugin.SQLITE3
    with rosbag2.Writer(folder / "drive", version=9, storage_plugin=plugin) as bag:
        _write_messages(bag, messages, store, store.serialize_cdr)
    return folder / "drive" if form == "folder" else folder / "drive" / f"drive.{form}"


def _write_messages(bag: Any, messages: Iterable[tuple[str, int, Any]], store: Any, serialize: Any) -> None:
    connections: dict[str, Any] = {}
    for topic, time, message in messages:
        kind = message.__msgtype__
        if topic not in connections:
            connections[topic] = bag.add_connection(topic, kind, typestore=store)
        bag.write(connections[topic], time, serialize(message, kind))


def make_car(store: Any, stamp: int, speed: float, counts: Iterable[int] = (1, 2)) -> Any:
    """A message of every kind of field."""
    kinds = store.types
    header = kinds["std_msgs/msg/Header"](
        kinds["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9), "base"
    )
    return kinds["cars/msg/Car"](
        header, speed, np.array([1, 2, 3, speed], np.float32), np.array(list(counts), np.int16),
        kinds["geometry_msgs/msg/Vector3"](-2.0 * speed, 0.5, 9.81), "text", speed > 15.0,
    )  # fmt: skip
