"""How long a question about many clips takes: DuckDB on a telemetry-only dataset beside pandas over CSV.

``python -m benchmarks.queries 10000`` makes 10,000 clips of one second (ten million ticks) and asks; the CSV holds
only the columns that the questions need, which is kind to pandas.
"""

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

import musync
from flows.generate import generate

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


def rows(clips: int = CLIPS) -> list[dict[str, Any]]:
    """Make the dataset and the CSV, and time the same questions on both.

    Returns
    -------
    Rows of name, value, unit, peer (what the value is held against) and ratio (value over peer).
    """
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "grid.yaml").write_text(yaml.safe_dump(grid_of(clips), sort_keys=False))
        making, report = _timed(
            lambda: generate(
                str(place / "grid.yaml"), str(place / "data"), runner="threads", workers=1, pictures=False
            )
        )
        opening, data = _timed(lambda: musync.open(place / "data"))
        connecting, _ = _timed(lambda: data.connection)
        wanted = ", ".join(COLUMNS)
        data.connection.execute(f"COPY (SELECT {wanted} FROM ticks) TO '{place / 'ticks.csv'}'")
        clip = data.manifest["clips"][report.clips // 2]["clip_id"]
        one = f"SELECT max(braking_slip_f) FROM ticks WHERE clip_id = '{clip}'"
        first, answer = _timed(lambda: data.sql(AGGREGATE).fetchall())
        again = min(_timed(lambda: data.sql(AGGREGATE).fetchall())[0] for _ in range(REPEATS))
        single, [(slip,)] = _timed(lambda: data.sql(one).fetchall())
        csv, (table, theirs) = _timed(lambda: _with_pandas(place / "ticks.csv", clip))
        same = (
            all(abs(a[1] - b) < 1e-9 for a, b in zip(answer, table, strict=True))
            and abs(slip - theirs) < 1e-12
        )
        data.connection.close()
    if not same:
        raise RuntimeError("DuckDB and pandas answered differently")
    peer = "pandas over CSV, both questions"
    return [
        {
            "name": "clips made",
            "value": making / report.clips * 1000,
            "unit": "ms/clip",
            "peer": None,
            "ratio": None,
        },
        {"name": "clips", "value": report.clips, "unit": "1", "peer": None, "ratio": None},
        {"name": "open and connect", "value": opening + connecting, "unit": "s", "peer": None, "ratio": None},
        {"name": "aggregate, first time", "value": first, "unit": "s", "peer": peer, "ratio": first / csv},
        {
            "name": "aggregate, again",
            "value": again,
            "unit": "s",
            "peer": f"limit {LIMIT_S}",
            "ratio": again / LIMIT_S,
        },
        {"name": "one clip", "value": single, "unit": "s", "peer": peer, "ratio": single / csv},
        {"name": "pandas over CSV", "value": csv, "unit": "s", "peer": None, "ratio": None},
    ]


def _with_pandas(path: Path, clip: str) -> tuple[list[float], float]:
    frame = pd.read_csv(path)
    means = frame.groupby("weather", sort=True)["longitudinal_acceleration"].mean()
    return means.tolist(), float(frame.loc[frame.clip_id == clip, "braking_slip_f"].max())


def _timed(call: Callable[[], Any]) -> tuple[float, Any]:
    started = time.perf_counter()
    result = call()
    return time.perf_counter() - started, result


if __name__ == "__main__":
    for row in rows(int(sys.argv[1]) if len(sys.argv) > 1 else CLIPS):
        ratio = "" if row["ratio"] is None else f"{row['ratio']:.3f} of {row['peer']}"
        print(f"{row['name']:24} {row['value']:10.4f} {row['unit']:8} {ratio}")
