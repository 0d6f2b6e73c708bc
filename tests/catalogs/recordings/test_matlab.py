"""MATLAB files of both kinds give the values that were saved, each on the clock that stands nearest."""

import struct
import zlib
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat
from scipy.io.matlab import MatlabFunction

from catalogs.recordings import matlab_hdf, matlab_v5, read_signals, summarise_signals
from tasks.errors import InputError
from tests.catalogs.recordings.written import make_map, take_speed, write_hdf

TIME = np.array([0.0, 10.0, 20.0, 31.0])
SPEED = np.array([50.0, 49.5, 48.25, 47.0])
WRITERS = {
    "v5": savemat,
    "v7": lambda path, tree: savemat(path, tree, do_compression=True),
    "v7.3": write_hdf,
}
either = pytest.mark.parametrize("write", WRITERS.values(), ids=WRITERS)


def saved(tmp_path: Path, write: Any, tree: dict[str, Any]) -> Path:
    write(tmp_path / "log.mat", tree)
    return tmp_path / "log.mat"


def read_refusal(path: Path, source: str, time: str = "Time") -> str:
    with pytest.raises(InputError) as caught:
        read_signals(path, take_speed(source, time={"source": time}))
    return str(caught.value)


@either
def test_structs_vectors_and_matrices_give_what_was_saved(tmp_path, write):
    acceleration = np.arange(12.0).reshape(4, 3) - 5.0
    tree = {
        "t": TIME, "v": SPEED,
        "log": {"speed": {"Time": TIME + 5.0, "Data": -SPEED, "DataInfo": {"Units": "km/h"}},
                "imu": {"Time": TIME[:4], "acc": acceleration, "count": np.arange(4, dtype=np.int16)}},
    }  # fmt: skip
    path = saved(tmp_path, write, tree)
    found = read_signals(
        path,
        make_map(
            {"speed": {"source": "log.speed.Data", "unit": "km/h"},
             "longitudinal_acceleration": {"source": "log.imu.acc(:,2)", "unit": "g"},
             "pitch": {"source": "log.imu.count", "unit": "deg"}},
            time={"source": "Time", "unit": "ms"},
        ),
    )  # fmt: skip
    speed = found["log.speed.Data"]
    np.testing.assert_array_equal(speed.values, -SPEED)
    np.testing.assert_allclose(speed.time, (TIME + 5.0) / 1e3, rtol=1e-15)
    assert speed.unit == "km/h"
    np.testing.assert_array_equal(found["log.imu.acc(:,2)"].values, acceleration[:, 1])
    np.testing.assert_array_equal(found["log.imu.count"].values, [0, 1, 2, 3])
    plain = read_signals(path, take_speed("v", time={"source": "t"}))["v"]
    np.testing.assert_array_equal(plain.values, SPEED)
    np.testing.assert_array_equal(plain.time, TIME)


@either
def test_a_clock_around_the_struct_serves_it_and_a_nearer_one_comes_first(tmp_path, write):
    tree = {"t": TIME, "log": {"v": SPEED, "own": {"t": TIME + 7.0, "v": SPEED}, "far": {"t": TIME * 2.0}}}
    path = saved(tmp_path, write, tree)
    for name, source, expected in (
        ("log.v", "t", TIME),
        ("log.own.v", "t", TIME + 7.0),
        ("log.v", "log.far.t", TIME * 2.0),
    ):
        found = read_signals(path, take_speed(name, time={"source": source}))[name]
        np.testing.assert_array_equal(found.time, expected)


def test_elements_of_an_array_of_structs_have_the_names_that_matlab_gives_them(tmp_path):
    entries = np.empty(2, dtype=object)
    entries[:] = [{"values": SPEED}, {"values": -SPEED}]
    WRITERS["v5"](tmp_path / "a.mat", {"out": {"time": TIME, "signals": entries}})
    # scipy writes an object array as cells; a structured array as structs
    structs = np.zeros((1, 2), dtype=[("values", object)])
    structs[0, 0], structs[0, 1] = (SPEED,), (-SPEED,)
    savemat(tmp_path / "v5.mat", {"out": {"time": TIME, "signals": structs}})
    write_hdf(
        tmp_path / "hdf.mat", {"out": {"time": TIME, "signals": [{"values": SPEED}, {"values": -SPEED}]}}
    )
    name = "out.signals(2).values"
    for file in ("v5.mat", "hdf.mat"):
        found = read_signals(tmp_path / file, take_speed(name, time={"source": "time"}))[name]
        np.testing.assert_array_equal(found.values, -SPEED)
        np.testing.assert_array_equal(found.time, TIME)
    assert "it is a cell array" in read_refusal(tmp_path / "a.mat", "out.signals", "time")


@either
def test_samples_without_a_value_are_left_out(tmp_path, write):
    path = saved(tmp_path, write, {"t": TIME, "v": np.array([50.0, np.nan, 48.0, 47.0])})
    found = read_signals(path, take_speed("v", time={"source": "t"}))["v"]
    np.testing.assert_array_equal(found.time, TIME[[0, 2, 3]])


@either
def test_what_is_no_signal_is_named_with_its_reason(tmp_path, write):
    path = saved(tmp_path, write, {"t": TIME, "v": SPEED, "short": SPEED[:3], "one": 7.0, "word": "fast"})
    assert "signal vv is missing; there are: v" in read_refusal(path, "vv", "t")
    assert "signal v needs its clock; no vector Time" in read_refusal(path, "v")
    assert "signal short must have a time for each of its 3 values; t has 4" in read_refusal(
        path, "short", "t"
    )
    assert "signal one must be a vector" in read_refusal(path, "one", "t")
    assert "signal word is missing" in read_refusal(path, "word", "t")
    with pytest.raises(InputError, match="needs time: "):
        read_signals(path, take_speed("v", time=None))


def test_objects_and_functions_are_refused_by_name_and_hurt_nothing_else(tmp_path):
    code = MatlabFunction(np.zeros((1, 1), dtype=[("x", object)]))
    savemat(tmp_path / "v5.mat", {"t": TIME, "v": SPEED})
    tree = {"t": TIME, "v": SPEED}
    assert matlab_v5._convert_value(code, 0).reason.startswith("must be of numbers; it is a function handle")
    write_hdf(tmp_path / "hdf.mat", tree)
    with h5py.File(tmp_path / "hdf.mat", "r+") as file:
        object_ = file.create_dataset("ts", data=np.zeros((1, 6), np.uint32))
        object_.attrs["MATLAB_class"] = np.bytes_("timeseries")
        object_.attrs["MATLAB_object_decode"] = np.int32(3)
    assert "signal ts.Data must be of numbers; it is a MATLAB object" in read_refusal(
        tmp_path / "hdf.mat", "ts.Data", "t"
    )
    assert len(read_signals(tmp_path / "hdf.mat", take_speed("v", time={"source": "t"}))["v"].values) == 4


def test_hdf_that_leads_to_other_files_or_in_circles_is_not_followed(tmp_path, monkeypatch):
    write_hdf(tmp_path / "secret.mat", {"v": SPEED})
    write_hdf(tmp_path / "log.mat", {"t": TIME, "s": {"x": SPEED}})
    with h5py.File(tmp_path / "log.mat", "r+") as file:
        file["v"] = h5py.ExternalLink(str(tmp_path / "secret.mat"), "v")
        file["soft"] = h5py.SoftLink("/t")
        layout = h5py.VirtualLayout((4,), float)
        layout[:] = h5py.VirtualSource(str(tmp_path / "secret.mat"), "v", (1, 4))[0]
        file.create_virtual_dataset("w", layout)
        (tmp_path / "raw").write_bytes(SPEED.tobytes())
        file.create_dataset("u", (4,), float, external=[(str(tmp_path / "raw"), 0, 32)])
    path = tmp_path / "log.mat"
    for name in ("v", "soft", "w", "u"):
        assert f"signal {name} must stand in the file itself" in read_refusal(path, name, "t")
    with h5py.File(path, "r+") as file:
        file["s/again"] = file["s"]
        file["s/twice"] = file["s"]
    monkeypatch.setattr(matlab_hdf, "MOST_NAMES", 1000)
    with pytest.raises(InputError, match="must have at most 1000 values"):
        summarise_signals(path, None)


def test_a_dataset_that_claims_billions_is_not_read(tmp_path):
    write_hdf(tmp_path / "log.mat", {"t": TIME})
    with h5py.File(tmp_path / "log.mat", "r+") as file:
        file.create_dataset("v", (10**12,), float, chunks=(1000,))
    assert "signal v must be a vector" in read_refusal(tmp_path / "log.mat", "v", "t")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            (9, 32),
            (99, 32),
            "a type that cannot stand in its array",
        ),  # the values: scipy ends the process at this one
        ((9, 32), (14, 32), "a type that cannot stand in its array"),
        ((9, 32), (9, 2**31), "ends within an element"),
        ((14, 80), (14, 72), "ends within an element"),
        ((6, 8), (5, 8), "an array without its class"),
    ],
)
def test_elements_that_would_end_the_process_are_refused(tmp_path, old, new, words):
    path = saved(tmp_path, savemat, {"v": SPEED})
    content = path.read_bytes()
    before, after = (struct.pack("<II", *pair) for pair in (old, new))
    assert content.count(before) == 1
    path.write_bytes(content.replace(before, after))
    assert words in read_refusal(path, "v")


def test_a_complex_array_without_its_second_element_is_refused(tmp_path):
    path = saved(tmp_path, savemat, {"v": SPEED})
    content = path.read_bytes()
    path.write_bytes(
        content.replace(struct.pack("<II", 6, 8) + b"\x06\x00", struct.pack("<II", 6, 8) + b"\x06\x08")
    )
    assert "too many or too few elements" in read_refusal(path, "v")


def test_packed_bytes_that_claim_all_memory_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(matlab_v5, "LARGEST_FILE", 2**20)
    packed = zlib.compress(bytes(2**22), 9)
    element = (15).to_bytes(4, "little") + len(packed).to_bytes(4, "little") + packed
    (tmp_path / "log.mat").write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + element)
    assert "log.mat: must have at most 1048576 bytes when unpacked" in read_refusal(
        tmp_path / "log.mat", "v", "t"
    )


@either
def test_the_list_has_a_row_for_each_signal_with_its_figures(tmp_path, write):
    path = saved(tmp_path, write, {"t": TIME, "log": {"v": SPEED, "m": np.ones((4, 2)), "unit": "m/s"}})
    rows = {
        row.signal: row
        for row in summarise_signals(path, take_speed("v", time={"source": "t", "unit": "ms"}))
    }
    assert set(rows) == {"t", "log.v", "log.m(:,1)", "log.m(:,2)"}
    row = rows["log.v"]
    assert (row.samples, row.unit, row.lowest, row.highest) == (4, "m/s", 47.0, 50.0)
    assert (row.start_s, row.end_s) == pytest.approx((0.0, 0.031))
    assert row.rate_hz == pytest.approx(3 / 0.031)
    assert {row.rate_hz for row in summarise_signals(path, None)} == {None}
