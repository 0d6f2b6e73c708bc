"""What is not represented is NULL to every reader: one count, mean, filter and order, in new and in older datasets."""

import json
import math
import re
from collections import defaultdict
from statistics import fmean

import duckdb
import pandas as pd
import pyarrow.compute as pc
import pyarrow.dataset
import pyarrow.parquet as pq
import pytest

import musync
from flows.making.generate import generate_dataset
from flows.reading.query import query_dataset
from flows.store.layout import Layout
from manifests.provenance import SOURCE_ROOT
from tests.flows.older import make_older
from tests.toy_street import write_toy_grid

STOPS_AND_COASTS = """
name: stops-and-coasts
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 21
frame_rate_hz: 10
axes:
  weather:
    dry: {{weather: dry}}
    rain-50: {{weather: rain, precipitation_mm_h: 50}}
  drive:
    stop: {{initial_speed_km_h: 15, peak_pressure_mpa: 2.3, brake_onset_s: 0.1}}
    later: {{initial_speed_km_h: 15, peak_pressure_mpa: 2.3, brake_onset_s: 0.3}}
    coast: {{initial_speed_km_h: 40}}
    hump: {{initial_speed_km_h: 40, hazard_center_m: 4, hazard_length_m: 3.7, hazard_height_m: 0.075}}
"""
COLUMN = "stopping_distance"


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Layout:
    folder = tmp_path_factory.mktemp("stops")
    grid = write_toy_grid(folder, STOPS_AND_COASTS)
    return generate_dataset(grid, str(folder / "data"), runner="threads", workers=1, pictures=False).layout


@pytest.fixture(scope="module", params=["new", "older"])
def layout(request, made, tmp_path_factory) -> Layout:
    return made if request.param == "new" else make_older(made, tmp_path_factory.mktemp("older") / "data")


@pytest.fixture(scope="module")
def clips(made) -> list[dict]:
    return json.loads(made.manifest.read_text())["clips"]


def test_the_documented_queries_answer_what_the_records_of_the_clips_say(layout, clips):
    text = (SOURCE_ROOT / "docs" / "how-to" / "query-a-dataset.md").read_text()
    asked = {*re.findall(r'musync sql \S+ "([^"]+)"', text), *re.findall(r'\.sql\("([^"]+)"\)', text)}
    answers = {
        query: [tuple(row.values()) for row in query_dataset(str(layout.root), query)["rows"]]
        for query in asked
        if query.upper().startswith("SELECT") and "..." not in query
    }
    figures = {clip["label"]: clip["figures"] for clip in clips}
    ticks = pd.concat(pd.read_parquet(file) for file in layout.telemetry.glob("ticks/*/*.parquet"))
    stops = defaultdict(list)
    for clip in clips:
        stops[clip["scenario"]["weather"]] += [clip["figures"][COLUMN]] * (
            clip["figures"][COLUMN] is not None
        )
    changes = [
        (a, b, None if None in (x[COLUMN], y[COLUMN]) else y[COLUMN] - x[COLUMN])
        for a, x in figures.items() for b, y in figures.items()
        if (a.split("/")[0], b.split("/")[0]) == ("dry", "rain-50") and a.split("/")[1] == b.split("/")[1]
    ]  # fmt: skip
    by_label = ticks.groupby("label", observed=True)
    expected = {
        f"SELECT weather, avg({COLUMN}) FROM clips GROUP BY weather": [
            (w, fmean(s)) for w, s in stops.items()
        ],
        f"SELECT label, {COLUMN}_p05, {COLUMN}, {COLUMN}_p95 FROM clips": [
            (label, *(row[f"{COLUMN}{part}"] for part in ("_p05", "", "_p95")))
            for label, row in figures.items()
        ],
        f"SELECT label_a, label_b, {COLUMN}_change FROM pairs WHERE control = 'weather'": changes,
        "SELECT label, max(braking_slip_f) AS slip FROM ticks GROUP BY label ORDER BY slip DESC": list(
            by_label["braking_slip_f"].max().items()
        ),
        "SELECT label, t_ns, speed FROM ticks": list(
            ticks[["label", "t_ns", "speed"]].itertuples(index=False, name=None)
        ),
    }
    # without road users there is nothing to hit: an unknown answer, not a 0
    passed, hits = sorted(query for query in answers if "collided" in query)
    expected |= {hits: [(weather, 0, None) for weather in stops], passed: []}
    assert answers.keys() == {*expected, "SELECT * FROM clips"}
    for query, rows in expected.items():
        assert sorted(answers[query], key=str) == sorted(rows, key=str), query
    assert len(stops["dry"]) == len(stops["rain"]) == 2 and len(answers["SELECT * FROM clips"]) == 8


def test_every_reader_counts_averages_filters_and_orders_alike(layout, clips):
    known = sorted(clip["figures"][COLUMN] for clip in clips if clip["figures"][COLUMN] is not None)
    expected = (len(known), pytest.approx(fmean(known)), sum(x > known[1] for x in known), known[-1])
    data = musync.open(layout.root)
    asked = f"SELECT count({COLUMN}), avg({COLUMN}), count(*) FILTER ({COLUMN} > {known[1]!r}) FROM clips"
    ordered = f"SELECT {COLUMN} FROM clips ORDER BY {COLUMN} DESC LIMIT 1"
    answers = {"sql": (*data.sql(asked).fetchall()[0], *data.sql(ordered).fetchall()[0])}
    frame = data.pandas("clips")
    answers["pandas"] = summarise_pandas(frame[COLUMN], known[1])
    stored = data.telemetry("clips")
    above = stored.to_table(filter=pyarrow.dataset.field(COLUMN) > known[1])
    column = stored.to_table(columns=[COLUMN])[COLUMN]
    answers["pyarrow"] = (
        pc.count(column).as_py(),
        pc.mean(column).as_py(),
        len(above),
        pc.max(column).as_py(),
    )
    assert stored.count_rows(filter=~(pyarrow.dataset.field(COLUMN) > known[-1])) == len(known)
    assert data.sql(f"SELECT count(*) FROM clips WHERE {COLUMN} IS NULL").fetchall() == [(4,)]
    assert data.sql("SELECT count(recovered_pitch) FROM frames").fetchall() == [(0,)]
    assert data.sql(f"SELECT count({COLUMN}_change), count(*) FROM pairs").fetchall() == [(4, 8)]
    data.connection.close()
    assert answers == dict.fromkeys(answers, expected)


def summarise_pandas(column, limit: float) -> tuple:
    top = column.sort_values(ascending=False).iloc[0]
    return int(column.count()), column.mean(), int((column > limit).sum()), top


def test_polars_counts_averages_filters_and_orders_as_sql_does(layout, clips):
    pl = pytest.importorskip("polars", reason="polars is optional")
    known = sorted(clip["figures"][COLUMN] for clip in clips if clip["figures"][COLUMN] is not None)
    with musync.open(layout.root).connection as connection:
        frame = pl.from_arrow(connection.sql("FROM clips").to_arrow_table())
    column = frame[COLUMN]
    assert (column.count(), column.null_count(), column.is_nan().sum()) == (4, 4, 0)
    assert column.mean() == pytest.approx(fmean(known)) and (column > known[1]).sum() == 2
    assert column.sort(descending=True, nulls_last=True)[0] == known[-1]


def test_a_stranger_who_reads_the_files_alone_gets_the_same(made, clips):
    known = sorted(clip["figures"][COLUMN] for clip in clips if clip["figures"][COLUMN] is not None)
    path = made.telemetry / "clips.parquet"
    with duckdb.connect() as connection:
        told = connection.sql(
            f"SELECT count({COLUMN}), avg({COLUMN}), count(*) FILTER ({COLUMN} > {known[1]!r}), max({COLUMN}),"
            f" count(*) FILTER ({COLUMN} IS NULL) FROM '{path}'"
        ).fetchall()[0]
        pairs = connection.sql(
            f"SELECT count({COLUMN}_change) FROM '{path.with_name('pairs.parquet')}'"
        ).fetchall()[0]
    assert told == (4, pytest.approx(fmean(known)), 2, known[-1], 4) and pairs == (4,)
    assert summarise_pandas(pd.read_parquet(path)[COLUMN], known[1]) == (
        4,
        pytest.approx(fmean(known)),
        2,
        known[-1],
    )
    for file in made.telemetry.rglob("*.parquet"):
        table = pq.read_table(file, partitioning=None)
        floats = [name for name in table.column_names if table.schema.field(name).type == "double"]
        assert not any(pc.any(pc.is_nan(table[name])).as_py() for name in floats), file


def test_answers_that_are_written_hold_null(layout, tmp_path):
    query = "SELECT label, stopping_distance, 'nan'::DOUBLE AS nothing FROM clips ORDER BY label"
    for to in ("parquet", "csv"):
        query_dataset(str(layout.root), query, to=to, out=str(tmp_path / f"answer.{to}"))
    table = pq.read_table(tmp_path / "answer.parquet")
    assert [table[name].null_count for name in table.column_names] == [0, 4, 8]
    assert not any(isinstance(x, float) and math.isnan(x) for row in table.to_pylist() for x in row.values())
    lines = (tmp_path / "answer.csv").read_text().splitlines()
    assert sum(line.endswith(",,") for line in lines) == 4
