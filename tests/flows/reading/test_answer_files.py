"""``musync sql --to``: the file holds the answer, replaces only its like, and opens no door for SQL."""

import csv
import json

import pandas as pd
import pyarrow.parquet as pq
import pytest

import flows.reading.query
import musync
from flows.reading.query import query_dataset
from tasks.errors import InputError
from tests.flows.shell import run_command

QUERY = "SELECT label, weather, t_ns, speed, pitch FROM ticks WHERE t_ns % 100000000 = 0"


@pytest.mark.parametrize("to", ["csv", "parquet"])
def test_the_file_holds_the_answer_to_the_last_bit(toy_dataset, tmp_path, to):
    out = tmp_path / f"speeds.{to}"
    told = query_dataset(str(toy_dataset.root), QUERY, to=to, out=str(out))
    assert told == {
        "file": str(out),
        "columns": ["label", "weather", "t_ns", "speed", "pitch"],
        "row_count": 44,
    }
    rows = query_dataset(str(toy_dataset.root), QUERY)["rows"]
    read = pd.read_csv(out) if to == "csv" else pd.read_parquet(out)
    assert read.to_dict("records") == rows


def test_parquet_keeps_types_and_csv_writes_null_empty_lists_as_json_and_formulas_as_text(
    toy_dataset, tmp_path
):
    query = (
        "SELECT NULL::DOUBLE AS n, [1.5::DOUBLE, 'nan'] AS l, -1.5 AS m, DATE '2025-01-01' AS d, true AS b,"
        """ '=1+1' AS "+f", 'a,"b' AS t"""
    )
    for to in ("csv", "parquet"):
        query_dataset(str(toy_dataset.root), query, to=to, out=str(tmp_path / to))
    with (tmp_path / "csv").open(newline="") as stream:
        names, row = csv.reader(stream)
    assert names == ["n", "l", "m", "d", "b", "'+f", "t"]
    assert row == ["", "[1.5, null]", "-1.5", "2025-01-01", "true", "'=1+1", 'a,"b']
    schema = pq.read_schema(tmp_path / "parquet")
    kinds = [str(kind).split("<")[0] for kind in schema.types]
    assert kinds == ["double", "list", "decimal128(2, 1)", "date32[day]", "bool", "string", "string"]
    assert schema.names[5] == "+f"


def test_decimals_are_numbers_and_structures_are_json(toy_dataset, tmp_path):
    query = (
        "SELECT 0.4 AS d, 2::DECIMAL(9, 0) AS w, {'a': 0.5, 'b': ['x', NULL]} AS s, MAP {1: 'nan'::DOUBLE} AS m,"
        " 12345678901234567890.123456789::DECIMAL(38, 9) AS long"
    )
    (row,) = query_dataset(str(toy_dataset.root), query)["rows"]
    structures = {"s": {"a": 0.5, "b": ["x", None]}, "m": {"1": None}}
    assert row == {"d": 0.4, "w": 2, **structures, "long": 12345678901234567890.123456789}
    assert isinstance(row["w"], int) and isinstance(row["d"], float)
    query_dataset(str(toy_dataset.root), query, to="csv", out=str(tmp_path / "a.csv"))
    with (tmp_path / "a.csv").open(newline="") as stream:
        (written,) = csv.DictReader(stream)
    assert (written["d"], written["w"], written["long"]) == ("0.4", "2", "12345678901234567890.123456789")
    assert {name: json.loads(written[name]) for name in structures} == structures


def test_columns_of_one_name_are_numbered_as_in_a_pandas_frame_and_none_is_lost(toy_dataset, tmp_path):
    query = "SELECT 1 AS a, 2 AS a, 3 AS a, 4 AS a_1, 5 AS A, 6 AS b"
    names = musync.open(toy_dataset.root).sql(query).df().columns.tolist()
    assert names == ["a", "a_1", "a_2", "a_1_1", "A_3", "b"]
    answer = query_dataset(str(toy_dataset.root), query)
    assert answer == {"columns": names, "rows": [dict(zip(names, range(1, 7), strict=True))]}
    for to, read in (("csv", pd.read_csv), ("parquet", pd.read_parquet)):
        told = query_dataset(str(toy_dataset.root), query, to=to, out=str(tmp_path / f"a.{to}"))
        assert told["columns"] == names
        assert read(tmp_path / f"a.{to}").to_dict("records") == answer["rows"]


def test_a_long_answer_prints_its_ends_and_says_how_to_get_the_rest(toy_dataset, monkeypatch, capsys):
    words = ("sql", str(toy_dataset.root), "SELECT range AS n FROM range(5000)")
    assert run_command(monkeypatch, *words) == 0
    shown = capsys.readouterr().out
    assert "left out: 4,960 of 5,000 rows; --to csv --out FILE writes all of them" in shown
    printed = [int(word) for word in shown.split("left out")[0].split() if word.isdigit()]
    assert printed == [*range(20), *range(4980, 5000)]
    assert run_command(monkeypatch, *words, "--json") == 0
    assert len(json.loads(capsys.readouterr().out)["rows"]) == 5000
    assert run_command(monkeypatch, *words[:2], "SELECT range AS n FROM range(100)") == 0
    assert "left out" not in capsys.readouterr().out


def test_its_own_file_is_written_again_and_a_strangers_never(toy_dataset, tmp_path):
    own, other = tmp_path / "own.csv", tmp_path / "thesis.csv"
    other.write_text("precious")
    for query in ("SELECT 1 AS a", "SELECT 2 AS a"):
        query_dataset(str(toy_dataset.root), query, to="csv", out=str(own))
    assert own.read_text() == "a\n2\n"
    with pytest.raises(InputError, match="is not a file that musync sql wrote"):
        query_dataset(str(toy_dataset.root), "SELECT 1", to="csv", out=str(other))
    (tmp_path / "link.csv").symlink_to(other)
    with pytest.raises(InputError, match="no link"):
        query_dataset(str(toy_dataset.root), "SELECT 1", to="csv", out=str(tmp_path / "link.csv"))
    assert other.read_text() == "precious"


def test_a_file_of_the_dataset_or_inside_its_folder_is_refused(toy_dataset):
    for name in ("manifest.json", "answers/a.csv"):
        with pytest.raises(InputError, match="must lie outside the dataset"):
            query_dataset(str(toy_dataset.root), "SELECT 1", to="csv", out=str(toy_dataset.root / name))


def test_wrong_options_are_told_at_once_before_the_query_runs(toy_dataset, monkeypatch):
    monkeypatch.setattr(flows.reading.query, "connect_views", lambda *_, **__: pytest.fail("asked"))
    for to, out, count in (("xlsx", None, 2), (None, "a.csv", 1), ("csv", None, 1), ("csv", "", 1)):
        with pytest.raises(InputError) as caught:
            query_dataset(str(toy_dataset.root), "SELECT 1", to=to, out=out)
        assert len(caught.value.problems) == count


@pytest.mark.parametrize("to", ["csv", "parquet"])
def test_sql_reaches_no_file_while_its_answer_is_written(toy_dataset, tmp_path, to):
    for query in ("SELECT * FROM read_text('/etc/hostname')", f"COPY clips TO '{tmp_path}/stolen.csv'"):
        with pytest.raises(InputError, match="lets SQL read and write files"):
            query_dataset(str(toy_dataset.root), query, to=to, out=str(tmp_path / "a"))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("to", ["csv", "parquet"])
def test_an_answer_too_large_or_none_leaves_no_file(toy_dataset, tmp_path, monkeypatch, to):
    monkeypatch.setattr(flows.reading.query, "MOST_VALUES", 10_000)
    with pytest.raises(InputError, match="at most 10,000 values"):
        query_dataset(str(toy_dataset.root), "SELECT * FROM ticks", to=to, out=str(tmp_path / "a"))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("to", ["csv", "parquet"])
def test_a_query_that_fails_or_has_no_answer_leaves_no_file(toy_dataset, tmp_path, to):
    told = {
        "-- nothing": "must be one SQL statement",
        "SELECT label::INT FROM ticks": "Could not convert",
        "SELEC": "syntax",
    }
    for query, sentence in told.items():
        with pytest.raises(InputError, match=sentence):
            query_dataset(str(toy_dataset.root), query, to=to, out=str(tmp_path / "a"))
    assert not list(tmp_path.iterdir())


def test_the_command_prints_where_the_answer_lies(toy_dataset, tmp_path, monkeypatch, capsys):
    words = (
        "sql",
        str(toy_dataset.root),
        "SELECT label FROM clips",
        "--to",
        "csv",
        "--out",
        str(tmp_path / "a.csv"),
    )
    assert run_command(monkeypatch, *words) == 0
    assert capsys.readouterr().out.replace("\n", " ").split()[:2] == ["file:", str(tmp_path / "a.csv")]
    assert run_command(monkeypatch, *words, "--json") == 0
    assert json.loads(capsys.readouterr().out)["row_count"] == 4
    assert run_command(monkeypatch, *words[:3], "--to", "xls") == 2
    assert "--to xls: must be csv or parquet" in capsys.readouterr().err
