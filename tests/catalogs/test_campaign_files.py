"""Files of a campaign: columns are read as others read them, and what is wrong with a file is named."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from catalogs.campaign_files import parse_columns
from tests.catalogs.campaign_folder import (
    braking_columns,
    change_header,
    list_problems,
    write_campaign,
    write_run,
)


@pytest.mark.parametrize(
    ("kind", "values"),
    [
        (pa.int64(), [1, None, 2**60 + 1]), (pa.int64(), [3, 2**60 + 1]), (pa.float32(), [0.1, float("inf")]),
        (pa.float64(), [None, 2.5]), (pa.float64(), [2.5, -0.0]), (pa.uint8(), []),
    ],
)  # fmt: skip
def test_a_column_is_read_as_arrow_and_pandas_read_it(tmp_path, kind, values):
    table = pa.table({"speed": pa.chunked_array([pa.array(values, kind), pa.array(values, kind)])})
    pq.write_table(table, tmp_path / "run.parquet")
    columns, _ = parse_columns((tmp_path / "run.parquet").read_bytes(), "run", ["speed"])
    expected = np.asarray(table["speed"].to_numpy(), np.float64)
    assert np.array_equal(columns["speed"], expected, equal_nan=True)
    assert columns["speed"].flags.writeable


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_campaign(tmp_path)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda h: h.update(split=3), "campaign.yaml: split: must be a table"),
        (lambda h: h["split"].update(train=[["run-01"]]), "split.train.0: must be a valid string"),
        (lambda h: h["tolerances_1sigma"].update(mass=float("nan")), "tolerances_1sigma.mass: must be a finite number"),
        (lambda h: h["tolerances_1sigma"].update(mass=0), "tolerances_1sigma.mass: must be greater than 0"),
        (lambda h: h.pop("tolerances_1sigma"), "campaign.yaml: tolerances_1sigma is missing"),
        (lambda h: [h["tolerances_1sigma"].pop("mass"), h["tolerances_1sigma"]["run"].pop("friction")],
         "campaign.yaml: tolerances_1sigma: mass, run.friction must be given: one sigma of each number"),
        (lambda h: h.update(sample_rate_hz=float("inf")), "sample_rate_hz: must be"),
        (lambda h: h.update(vehicle=7), "vehicle: must be a valid string; it is 7"),
    ],
)  # fmt: skip
def test_a_faulty_header_is_named_by_its_key_beside_faulty_runs(folder: Path, change, words: str) -> None:  # type: ignore[no-untyped-def]
    change_header(folder, change)
    table = (folder / "runs.csv").read_text()
    (folder / "runs.csv").write_text(table.replace("run-02,dry", "run-02,hail"))
    text = list_problems(folder)
    assert words in text and "run-02: weather must be dry, rain" in text


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("run-02", "run-0é".encode("latin-1"), "runs.csv must be UTF-8 text; line 3 is not"),
        ("run-02", b"x" * 200_000, "runs.csv must be CSV; field larger than field limit"),
        ("run-02", b"run-01", "run-01: stands twice in runs.csv"),
        ("run-02", b"../run-02", "a run's name must be no path"),
        ("run-02,", b"run-02,dry,", "run 2: must have as many fields as there are columns"),
        ("weather", b"run", "must have distinct columns; 'run' stands there twice"),
        ("run-02,dry,0.0", b"run-02,dry,nan", "run-02: precipitation_mm_h must be a finite number; it is 'nan'"),
        ("run-02,dry,0.0,0.0,1,", b"run-02,dry,0.0,0.0,0,", "run-02: direction must be 1 or -1; it is 0"),
    ],
)  # fmt: skip
def test_a_faulty_line_of_runs_is_named(folder: Path, old: str, new: bytes, words: str) -> None:
    content = (folder / "runs.csv").read_bytes()
    (folder / "runs.csv").write_bytes(content.replace(old.encode(), new, 1))
    text = list_problems(folder)
    assert words in text and len(text) < 1500


def test_faulty_parquet_files_are_all_named(folder: Path) -> None:
    columns = braking_columns(1)
    whole = (folder / "runs" / "run-01.parquet").read_bytes()
    (folder / "runs" / "run-01.parquet").write_bytes(whole[: len(whole) // 2])
    write_run(folder, "run-02", columns | {"pitch": np.array(["x"] * 300)})
    write_run(folder, "run-03", columns | {"speed": np.array(columns["speed"], dtype="datetime64[s]")})
    twice = pa.Table.from_arrays([pa.array([1.0])] * 2, names=["speed", "speed"])
    pq.write_table(twice, folder / "runs" / "run-04.parquet")
    odd = pa.schema([pa.field("pitch", pa.float64(), metadata={"units": b"\xff\xfe"})])
    pq.write_table(pa.table({"pitch": columns["pitch"]}, schema=odd), folder / "runs" / "run-05.parquet")
    (folder / "runs" / "run-06.parquet").write_bytes(b"")
    text = list_problems(folder)
    for words in (
        "run-01: run-01.parquet must be a Parquet file of numbers",
        "run-02: channel pitch must be of numbers; run-02.parquet has it as string",
        "run-03: channel speed must be of numbers",
        "run-04: run-04.parquet must have distinct columns; speed stands there twice",
        "run-05: channel pitch must be in deg; its metadata says",
        "run-06: run-06.parquet must be a Parquet file",
    ):
        assert words in text


def test_a_run_of_more_samples_than_memory_holds_is_refused_unread(folder: Path) -> None:
    many = pa.table({"speed": pa.chunked_array([pa.nulls(1_000_000, pa.float32())] * 21)})
    pq.write_table(many, folder / "runs" / "run-02.parquet")
    assert "run-02.parquet must have at most 20000000 samples; it has 21000000" in list_problems(folder)
