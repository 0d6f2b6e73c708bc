"""ROS bags and MCAP files give the numbers of their messages, on the clock of the header where there is one."""

import sqlite3
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags import rosbag1
from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat

from catalogs.recordings import bag_types, read_signals, recording_files, stored_files, summarise_signals
from tasks.errors import InputError
from tests.catalogs.recordings.written import FORMS, make_car, make_map, make_store, take_speed, write_bag

START = 1_700_000_000_000_000_000
SPEEDS = [20.0, 17.5, 15.25, 12.0]
STAMPS = [int(k * 20e6) for k in range(4)]
LATE = 7_000_000
either = pytest.mark.parametrize("form", FORMS)


def write_drive(store: Any, stamped: bool = True) -> list[tuple[str, int, Any]]:
    """A car's messages, logged 7 ms after their stamps, and one number without a header beside each."""
    number = store.types["std_msgs/msg/Float64"]
    messages = []
    for stamp, speed in zip(STAMPS, SPEEDS, strict=True):
        car = make_car(store, START + stamp if stamped else 0, speed, counts=range(2 if speed > 16 else 1))
        messages += [
            ("/car", START + stamp + LATE, car),
            ("/brake/bar", START + stamp + LATE, number(-speed)),
        ]
    return messages


def read_refusal(path: Path, source: str) -> str:
    with pytest.raises(InputError) as caught:
        read_signals(path, take_speed(source))
    return str(caught.value)


@either
def test_fields_elements_and_times_are_those_of_the_messages(tmp_path, form):
    path = write_bag(tmp_path, form, write_drive(make_store()))
    names = [
        "/car.speed",
        "/car.wheels[3]",
        "/car.acceleration.x",
        "/car.counts[1]",
        "/car.braking",
        "/brake/bar.data",
    ]
    channels = [
        "speed",
        "wheel_speed_front",
        "longitudinal_acceleration",
        "pitch",
        "pitch_rate",
        "brake_pressure",
    ]
    units = ["m/s", "rad/s", "m/s^2", "deg", "deg/s", "bar"]
    found = read_signals(
        path, make_map({c: {"source": n, "unit": u} for c, n, u in zip(channels, names, units, strict=True)})
    )
    expected = [SPEEDS, SPEEDS, [-2 * v for v in SPEEDS], [1, 1], [1, 1, 1, 0], [-v for v in SPEEDS]]
    for name, values in zip(names, expected, strict=True):
        np.testing.assert_array_equal(found[name].values, values, err_msg=name)
    # times count from the first message of the log, which is 7 ms late; those of the header are before it
    np.testing.assert_allclose(found["/car.speed"].time, np.array(STAMPS) * 1e-9 - 0.007, atol=1e-12)
    np.testing.assert_allclose(found["/brake/bar.data"].time, np.array(STAMPS) * 1e-9, atol=1e-12)


@either
def test_a_header_that_nobody_filled_in_leaves_the_time_of_the_log(tmp_path, form):
    path = write_bag(tmp_path, form, write_drive(make_store(), stamped=False))
    found = read_signals(path, take_speed("/car.speed"))["/car.speed"]
    np.testing.assert_allclose(found.time, np.array(STAMPS) * 1e-9, atol=1e-12)


@either
def test_the_list_has_a_row_for_each_number_and_none_for_text_header_and_pictures(tmp_path, form):
    store = make_store()
    picture = ("/car", START + 10**9, make_car(store, START + 10**9, 3.0, counts=range(500)))
    rows = {
        row.signal: row
        for row in summarise_signals(write_bag(tmp_path, form, [*write_drive(store), picture]), None)
    }
    assert set(rows) == {
        "/car.speed", *(f"/car.wheels[{k}]" for k in range(4)), "/car.counts[0]", "/car.counts[1]",
        *(f"/car.acceleration.{axis}" for axis in "xyz"), "/car.braking", "/brake/bar.data",
    }  # fmt: skip
    row = rows["/brake/bar.data"]
    assert (row.samples, row.lowest, row.highest) == (4, -20.0, -12.0)
    assert row.rate_hz == pytest.approx(50.0)
    assert (row.start_s, row.end_s) == pytest.approx((0.0, 0.06))
    assert rows["/car.counts[0]"].samples == 4


def test_a_bag_folder_is_one_recording_and_its_files_are_those_that_are_hashed(tmp_path):
    folder = write_bag(tmp_path, "folder", write_drive(make_store()))
    assert recording_files(folder) == (folder,) == recording_files(tmp_path)
    assert stored_files(folder) == (folder / "drive.db3",)
    runs = [{"name": "a", "file": "drive"}]
    assert recording_files(folder, take_speed("x", runs=runs)) == (folder,)


def test_files_that_the_folder_names_elsewhere_are_not_read(tmp_path):
    folder = write_bag(tmp_path, "folder", write_drive(make_store()))
    (folder / "drive.db3").rename(tmp_path / "elsewhere.db3")
    other = (
        write_bag(tmp_path / "b", "mcap", write_drive(make_store())[:2])
        if (tmp_path / "b").mkdir() is None
        else None
    )
    other.rename(folder / "drive.mcap")
    metadata = folder / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("drive.db3", "../elsewhere.db3"))
    assert len(read_signals(folder, take_speed("/car.speed"))["/car.speed"].values) == 1


@pytest.mark.parametrize(
    "view",
    [
        "CREATE VIEW schema AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x FROM c) SELECT x FROM c",
        "CREATE TABLE more(a, b AS (zeroblob(1000000000)))",
        "CREATE TRIGGER t AFTER INSERT ON topics BEGIN DELETE FROM topics; END",
    ],
)
def test_a_database_with_programs_in_it_is_refused(tmp_path, view):
    path = write_bag(tmp_path, "db3", write_drive(make_store()))
    with sqlite3.connect(path) as database:
        database.execute("DROP TABLE schema")
        database.execute(view)
    assert "must be a database of plain tables" in read_refusal(path, "/car.speed")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("string[100000] names\n", "at most 10000 elements; it has 100000"),
        ("Thing[100000] things\n", "at most 10000 elements"),
        ("float64 x\n" * 200_000, "must be defined in at most"),
    ],
)
def test_a_definition_out_of_which_too_much_code_would_be_made_is_refused(text, words):
    definition = MessageDefinition(MessageDefinitionFormat.MSG, text)
    with pytest.raises(InputError, match=words):
        bag_types.make_type_store(definition, "cars/msg/Car")


def test_names_that_are_code_never_reach_the_code_generator(monkeypatch):
    evil = "x', []): 0}\nimport os; os.mkdir('PWNED')\n{('"
    for types in (
        {evil: ([], [])},
        {"a/msg/B": ([], [(evil, (1, ("int8", 0)))])},
        {"a/msg/B": ([], [("x", (2, evil))])},
    ):
        monkeypatch.setattr(bag_types, "_parse_definition", lambda *_, types=types: types)
        with pytest.raises(InputError, match="letters, digits and underscores"):
            bag_types.make_type_store(MessageDefinition(MessageDefinitionFormat.MSG, ""), "a/msg/B")
    monkeypatch.setattr(bag_types, "_parse_definition", lambda *_: {"a/msg/B": ([("X", "int8", evil)], [])})
    store = bag_types.make_type_store(MessageDefinition(MessageDefinitionFormat.MSG, ""), "a/msg/B")
    assert store.fielddefs["a/msg/B"][0] == [] and not Path("PWNED").exists()


@pytest.mark.parametrize("form", ["lz4", "zstd"])
def test_a_piece_that_claims_all_memory_is_refused(form, monkeypatch):
    from backports import zstd
    from lz4 import frame
    from rosbags.rosbag2 import storage_mcap

    monkeypatch.setattr(bag_types, "LARGEST_CHUNK", 2**20)
    bag_types.bound_unpacking()
    pack = {"lz4": frame.compress, "zstd": zstd.compress}[form]
    unpack = storage_mcap.DECOMPRESSORS[form]
    assert unpack(pack(bytes(1000)), 1000) == bytes(1000)
    with pytest.raises(InputError, match="one is larger or cut off"):
        unpack(pack(bytes(2**24)), 2**24)


def test_a_topic_of_two_publishers_in_turns_is_given_by_the_publisher(tmp_path: Path) -> None:
    store = make_store()
    path = tmp_path / "log.bag"
    with rosbag1.Writer(path) as bag:
        writers = [
            bag.add_connection("/car", "cars/msg/Car", typestore=store, callerid=name)
            for name in ("/a", "/b")
        ]
        for k in range(4):
            stamp = (k + 1) * 10**8
            message = make_car(store, stamp, 10.0 + k)
            bag.write(writers[k % 2], stamp, store.serialize_ros1(message, message.__msgtype__))
    with pytest.raises(InputError, match=r"/car is written by several publishers in turns.* as /car#"):
        read_signals(path, take_speed("/car.speed"))
    assert read_signals(path, take_speed("/car#2.speed"))["/car#2.speed"].values.tolist() == [11.0, 13.0]


def test_a_package_that_lacks_one_of_its_own_is_not_taken_for_missing(tmp_path, monkeypatch):
    (tmp_path / "rosbags.py").write_text("import no_such_codec")
    (tmp_path / "log.mcap").write_bytes(b"")
    for loaded in [name for name in sys.modules if name.partition(".")[0] == "rosbags"]:
        monkeypatch.delitem(sys.modules, loaded)
    monkeypatch.syspath_prepend(tmp_path)
    told = read_refusal(tmp_path / "log.mcap", "/car.speed")
    assert "rosbags, which is installed and does not load" in told and "no_such_codec" in told
