"""Text files as loggers and spreadsheets write them: what is no number is named with its row and what to do."""

from pathlib import Path

import pandas as pd
import pytest
import yaml
from typer.testing import CliRunner

from catalogs.entries import load
from catalogs.recordings import read_signals, summarise_signals
from flows.cli import app
from flows.measured.importing import import_measurements
from tasks.errors import InputError
from tests.campaign.recorded import MAP

WANTED = "channels: {speed: {source: v, unit: m/s}}\ntime: {source: t}\n"


def read(folder: Path, text: bytes, rest: str = "") -> dict[str, list[float]]:
    (folder / "log.csv").write_bytes(text)
    content = yaml.safe_load(MAP) | yaml.safe_load(WANTED + rest)
    content["not_measured"] = sorted(yaml.safe_load(MAP)["channels"].keys() - {"speed"})
    (folder / "map.yaml").write_text(yaml.safe_dump(content))
    channel_map, _ = load("channel map", folder / "map.yaml")
    signals = read_signals(folder / "log.csv", channel_map)
    return {"t": signals["v"].time.tolist(), "v": signals["v"].values.tolist()}


@pytest.mark.parametrize(
    "text",
    [
        b"t,v\n0,10\n1,11\n",
        b"t,v\n0,10,\n1,11,\n",  # a separator at the end of each row
        b"t,v,\n0,10,\n1,11,\n",
        b"\xef\xbb\xbft,v\r\n0,10\r\n1,11\r\n",
        "t,v,slope [\u00b0]\n0,10,1\n1,11,1\n".encode("latin-1"),
    ],
)
def test_each_value_stands_under_its_own_name(tmp_path: Path, text: bytes) -> None:
    assert read(tmp_path, text) == {"t": [0.0, 1.0], "v": [10.0, 11.0]}


@pytest.mark.parametrize("text", [b"t,p,v\n0,1,\n0,,10\n1,2,\n1,,11\n", b"t,v\n0,10\n0,12\n1,11\n1,13\n"])
def test_the_first_sample_of_a_time_is_the_first_that_has_a_value(tmp_path: Path, text: bytes) -> None:
    rest = "time: {source: t, repeats: keep_first}\n"
    assert read(tmp_path, text, rest) == {"t": [0.0, 1.0], "v": [10.0, 11.0]}


@pytest.mark.parametrize(
    ("text", "rest", "words"),
    [
        (b"t,v\n0,10,5\n1,11,6\n", "", "more values than the first line has names"),
        (b"t;v\n0;10\n", "", r'the first line is .t;v.: give csv: {separator: ";"} in the map'),
        (b"t\tv\n0\t10\n", "", r'give csv: {separator: "\\t"} in the map'),
        (b"\n\nt;v\n0;10\n", "csv: {skip_rows: 2}", r'give csv: {separator: ";"}'),
        (b"t;v\n0;10,5\n1;11,5\n", "csv: {separator: ;}", "v must be of numbers; row 1 .* '10,5': give csv: {decimal"),
        (
            b"t,v\ns,m/s\n0,10\n1,11\n", "",
            "it holds 's', 'm/s', which looks like a row of units: give csv: {units_row: true} in the map",
        ),
        (b"t,v\n,m/s\n0,10\n1,11\n", "", "it holds 'm/s', which looks like a row of units"),
        (b"t,v\n0,Err\n1,11\n", "", "v must be of numbers; row 1 .* 'Err': if this is a row of units, give csv"),
        (b"t,v\n0,10\n1,11\n", "csv: {units_row: true}", "must hold units; it is '0,10': leave units_row away"),
        (b't,v\ns,"m\n0,1\n1,2\n', "csv: {units_row: true}", "the row of units must be a row of text"),
        (b"t,v\nms,m/s\n0,10\n1,11\n", "csv: {units_row: true}", "clock t is in ms by its file, in s by the map"),
        (b"t,v\n0,10\n1,Err\n", "", "v must be of numbers; row 2 .* 'Err': correct it, or leave it empty"),
        (b"t,v\n12:00:01,10\nnoon,11\n", "", "t must be of numbers, dates or times of day; row 2 .* 'noon': write"),
        ("t,v\n0,10\n".encode("utf-16"), "", "must be UTF-8 or Latin-1 text; it holds zero bytes: save it as UTF-8"),
    ],
)  # fmt: skip
def test_what_is_no_number_is_named_with_what_to_do(
    tmp_path: Path, text: bytes, rest: str, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        read(tmp_path, text, rest)


AIM = '"Format","AiM"\n\n"t","v","slope"\n"s","[km/h]","\u00b0"\n\n"0.0","10","1"\n"1.0","11","1"\n'
"""As AiM's loggers export, with rows above the names, a row of units and an empty one below."""


@pytest.mark.parametrize("encoding", ["latin-1", "utf-8"])
def test_a_row_of_units_is_read_where_the_map_tells_of_it(tmp_path: Path, encoding: str) -> None:
    rest = "csv: {skip_rows: 2, units_row: true}\n"
    assert read(tmp_path, AIM.encode(encoding), rest) == {"t": [0.0, 1.0], "v": [10.0, 11.0]}
    channel_map, _ = load("channel map", tmp_path / "map.yaml")
    rows = summarise_signals(tmp_path / "log.csv", channel_map)
    assert [(row.signal, row.unit, row.samples) for row in rows] == [
        ("t", "s", 2),
        ("v", "km/h", 2),
        ("slope", "\u00b0", 2),
    ]


def test_a_unit_below_the_names_must_be_the_maps(tmp_path: Path) -> None:
    read(tmp_path, AIM.encode(), "csv: {skip_rows: 2, units_row: true}\n")
    told = (
        "channel speed: is in km/h by its file, in m/s by the map: give the file's unit; where the file is wrong, keep"
        " its unit and give scale: 3.6"
    )
    with pytest.raises(InputError, match=told):
        import_measurements(
            str(tmp_path / "log.csv"), map=str(tmp_path / "map.yaml"), out=str(tmp_path / "campaign")
        )


def test_a_name_in_latin_1_is_read_as_it_is_written(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_bytes("slope [\u00b0],a [m/s\u00b2]\n1,2\n".encode("latin-1"))
    assert [row.signal for row in summarise_signals(tmp_path / "log.csv", None)] == [
        "slope [\u00b0]",
        "a [m/s\u00b2]",
    ]


def test_a_list_of_signals_shows_those_that_are_text(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("t,v\ns,m/s\n0,10\n1,12\n")
    rows = {row.signal: row for row in summarise_signals(tmp_path / "log.csv", None)}
    assert (rows["v"].samples, rows["v"].lowest, rows["v"].highest) == (2, 10.0, 12.0)
    assert "'m/s': if this is a row of units, give csv: {units_row: true}" in rows["v"].note
    shown = CliRunner().invoke(
        app, ["import-measurements", str(tmp_path), "--list-signals"], env={"COLUMNS": "200"}
    )
    assert shown.exit_code == 0 and "units_row: true" in shown.output


@pytest.mark.parametrize("column", ["t", "v"])
def test_a_list_of_signals_of_parquet_shows_the_type_that_is_none_of_numbers(
    tmp_path: Path, column: str
) -> None:
    table = pd.DataFrame({"t": [0.0, 1.0], "v": [10.0, 12.0]})
    table[column] = pd.to_datetime(table[column], unit="s")
    table.to_parquet(tmp_path / "log.parquet")
    (tmp_path / "map.yaml").write_text("time: {source: t}\n")
    listed = import_measurements(
        str(tmp_path / "log.parquet"), map=str(tmp_path / "map.yaml"), list_signals=True
    )
    rows = {row["signal"]: row for row in listed["signals"]["log.parquet"]}
    if column == "t":  # a clock
        assert rows["v"]["rate_hz"] == 1.0 and not rows["t"]["note"]
    else:
        assert rows["v"]["samples"] == 0 and "it is of dates or times" in rows["v"]["note"]
