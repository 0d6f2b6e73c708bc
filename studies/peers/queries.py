"""How long a question about many clips takes: DuckDB on a telemetry-only dataset beside pandas over CSV and SQLite.

``python -m studies.peers.queries 10000`` makes 10,000 clips of one second (ten million ticks) and asks; the CSV holds
only the columns that the questions need, which is kind to pandas. SQLite's table too, and it has an index of clips.
"""

import argparse
import sqlite3
import tempfile
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import yaml

import musync
from benchmarks.side_by_side import make_row, print_rows
from flows.cli import run_to_end
from flows.making.generate import generate_dataset
from tasks.errors import InputError

CLIPS = 1000
LEVELS = 10
REPEATS = 3
COLUMNS = ("clip_id", "weather", "longitudinal_acceleration", "braking_slip_f")
AGGREGATE = (
    "SELECT weather, avg(longitudinal_acceleration), max(braking_slip_f) FROM ticks"
    " GROUP BY weather ORDER BY weather"
)
LIMIT_S = 0.5


def grid_of(clips: int) -> dict[str, Any]:
    """A grid of at least that many clips of one second: ten weathers, ten pressures, and as many speeds as it takes."""
    rain = {f"rain-{r}": {"weather": "rain", "precipitation_mm_h": r} for r in (2, 5, 10, 25, 50)}
    snow = {f"snow-{r}": {"weather": "snow", "precipitation_mm_h": r, "snow_accumulation_h": 1}
            for r in (0.5, 1, 2, 3)}  # fmt: skip
    pressures = {f"p{i}": {"peak_pressure_mpa": 0.5 + 0.2 * i} for i in range(LEVELS)}
    speeds = -(-clips // LEVELS**2)
    return {
        "name": "queries",
        "frames": 11,
        "base": {"brake_onset_s": 0.1},
        "axes": {
            "weather": {"dry": {"weather": "dry"}, **rain, **snow},
            "pressure": pressures,
            "speed": {f"v{i}": {"initial_speed_km_h": 30 + 60 * i / speeds} for i in range(speeds)},
        },
    }


def measure_rows(clips: int = CLIPS) -> list[dict[str, Any]]:
    """Make the dataset and the CSV, and time the same questions on both.

    Returns
    -------
    Rows of name, value, unit, peer (what the value is held against) and ratio (value over peer).
    """
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "grid.yaml").write_text(yaml.safe_dump(grid_of(clips), sort_keys=False))
        making, _, report = _measure_time(
            lambda: generate_dataset(
                str(place / "grid.yaml"), str(place / "data"), runner="threads", workers=1, pictures=False
            )
        )
        opening, opening_cpu, data = _measure_time(lambda: _open_dataset(place / "data"))
        wanted = ", ".join(COLUMNS)
        with musync.open(place / "data", allow_files=True).connection as writing:
            writing.execute(f"COPY (SELECT {wanted} FROM ticks) TO '{place / 'ticks.csv'}'")
        clip = data.manifest["clips"][report.clips // 2]["clip_id"]
        one = f"SELECT max(braking_slip_f) FROM ticks WHERE clip_id = '{clip}'"
        first, first_cpu, answer = _measure_time(lambda: data.sql(AGGREGATE).fetchall())
        again, again_cpu, _ = min(
            _measure_time(lambda: data.sql(AGGREGATE).fetchall()) for _ in range(REPEATS)
        )
        single, single_cpu, [(slip,)] = _measure_time(lambda: data.sql(one).fetchall())
        csv, csv_cpu, (table, theirs) = _measure_time(lambda: _with_pandas(place / "ticks.csv", clip))
        same = (
            all(abs(a[1] - b) < 1e-9 for a, b in zip(answer, table, strict=True))
            and abs(slip - theirs) < 1e-12
        )
        data.connection.close()
        sqlite = _measure_sqlite(place / "ticks.csv", clip)
        same &= all(abs(a[1] - b[1]) < 1e-9 for a, b in zip(answer, sqlite.table, strict=True))
        same &= abs(slip - sqlite.slip) < 1e-12
    if not same:
        raise RuntimeError("DuckDB, pandas and SQLite answered differently")
    peer = "pandas over CSV, both questions"
    limit = f"limit {LIMIT_S}"
    return [
        make_row("clips made", making / report.clips * 1000, "ms/clip"),
        make_row("clips", report.clips, "1"),
        make_row("open and connect", opening, "s"),
        make_row("aggregate, first time", first, "s", peer, csv),
        make_row("aggregate, again", again, "s", limit, LIMIT_S),
        make_row("one clip", single, "s", peer, csv),
        make_row("pandas over CSV", csv, "s"),
        # of all threads together, which says the same on a busy machine
        make_row("open and connect, CPU", opening_cpu, "s"),
        make_row("aggregate, first time, CPU", first_cpu, "s", peer, csv_cpu),
        make_row("aggregate, again, CPU", again_cpu, "s", limit, LIMIT_S),
        make_row("one clip, CPU", single_cpu, "s", peer, csv_cpu),
        make_row("pandas over CSV, CPU", csv_cpu, "s"),
        make_row("SQLite, aggregate, CPU", sqlite.aggregate_s, "s", "ours, again", again_cpu),
        make_row("SQLite, one clip, CPU", sqlite.single_s, "s", "ours", single_cpu),
        make_row("SQLite, filled and indexed, CPU", sqlite.filling_s, "s"),
    ]


class _OfSqlite(NamedTuple):
    """Processor time of filling and of both questions [CPU-s], and the answers."""

    filling_s: float
    aggregate_s: float
    single_s: float
    table: list[tuple[Any, ...]]
    slip: float


def _measure_sqlite(csv: Path, clip: str) -> _OfSqlite:
    """The same questions to SQLite, on disk and indexed by clip."""
    with closing(sqlite3.connect(csv.with_suffix(".sqlite"))) as connection:

        def fill() -> None:
            names = ", ".join(COLUMNS)
            connection.execute(f"CREATE TABLE ticks ({names})")
            for rows in pd.read_csv(csv, chunksize=500_000):
                connection.executemany(
                    f"INSERT INTO ticks ({names}) VALUES (?, ?, ?, ?)",
                    rows[list(COLUMNS)].itertuples(index=False, name=None),
                )
            connection.execute("CREATE INDEX clips ON ticks (clip_id)")
            connection.commit()

        _, filling_s, _ = _measure_time(fill)
        _, aggregate_s, table = min(
            _measure_time(lambda: connection.execute(AGGREGATE).fetchall()) for _ in range(REPEATS)
        )
        one = "SELECT max(braking_slip_f) FROM ticks WHERE clip_id = ?"
        _, single_s, [(slip,)] = min(
            _measure_time(lambda: connection.execute(one, (clip,)).fetchall()) for _ in range(REPEATS)
        )
    return _OfSqlite(filling_s, aggregate_s, single_s, table, slip)


def _open_dataset(folder: Path) -> musync.Dataset:
    data = musync.open(folder)
    data.connection.execute("SELECT 1").fetchall()
    return data


def _with_pandas(path: Path, clip: str) -> tuple[list[float], float]:
    frame = pd.read_csv(path)
    means = frame.groupby("weather", sort=True)["longitudinal_acceleration"].mean()
    return means.tolist(), float(frame.loc[frame.clip_id == clip, "braking_slip_f"].max())


def _measure_time(call: Callable[[], Any]) -> tuple[float, float, Any]:
    """By the clock and of the processor [s], and what came back."""
    clock, processor = time.perf_counter(), time.process_time()
    result = call()
    return time.perf_counter() - clock, time.process_time() - processor, result


def run_benchmark() -> None:
    """Ask about as many clips as the command line names, and print a row for each question and tool."""
    parser = argparse.ArgumentParser(prog="python -m studies.peers.queries")
    parser.add_argument(
        "clips",
        type=int,
        nargs="?",
        default=CLIPS,
        help="number of clips of one second, rounded up to hundreds",
    )
    clips = parser.parse_args().clips
    if clips < 1:
        raise InputError(f"clips must be 1 or more; it is {clips}")
    print_rows(measure_rows(clips))


if __name__ == "__main__":
    run_to_end(run_benchmark)
