"""What a table states is read, or refused in a sentence: names that stand twice, rows below them, no value, times."""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from catalogs.campaign_files import LONGEST_COLUMN, MOST_COLUMNS, MOST_SAMPLES
from catalogs.channel_maps import ChannelMap
from catalogs.recordings import read_signals, summarise_signals
from tasks.errors import InputError
from tests.catalogs.recordings.written import make_map, take_speed


def take(source: str = "v", time: dict[str, Any] | None = None, **changes: Any) -> ChannelMap:
    return take_speed(source, time=time or {"source": "t"}, **changes)


def write(folder: Path, text: str) -> Path:
    (folder / "log.csv").write_text(text)
    return folder / "log.csv"


def read_values(path: Path, channel_map: ChannelMap) -> list[float]:
    return next(iter(read_signals(path, channel_map).values())).values.tolist()


def read_times(path: Path, channel_map: ChannelMap) -> list[float]:
    return next(iter(read_signals(path, channel_map).values())).time.tolist()


def write_twice(folder: Path, form: str) -> Path:
    if form == "csv":
        return write(folder, "t,v,v\n0,1,7\n1,2,8\n")
    columns = [pa.array([0.0, 1.0]), pa.array([1.0, 2.0]), pa.array([7.0, 8.0])]
    pq.write_table(pa.Table.from_arrays(columns, names=["t", "v", "v"]), folder / "log.parquet")
    return folder / "log.parquet"


@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_a_name_that_stands_twice_is_refused_with_a_name_for_each(tmp_path: Path, form: str) -> None:
    path = write_twice(tmp_path, form)
    with pytest.raises(InputError, match=r"v stands 2 times: .* v#1 \(column 2.*, v#2 \(column 3"):
        read_signals(path, take())
    assert read_values(path, take("v#2")) == [7.0, 8.0]
    assert [row.signal for row in summarise_signals(path, None)] == ["t", "v#1", "v#2"]


RACE = 'Format,3\nNote,"one line\nand another"\n\nt,v\ns,m/s\n100: gps,calc\n0,1\n1,2\n'
"""As a lap timer exports: a note over two lines, and two rows below the names."""


def test_rows_below_the_names_are_declared_and_the_advice_fits_what_the_map_has(tmp_path: Path) -> None:
    path = write(tmp_path, RACE)
    with pytest.raises(InputError, match=r"stand in row 4: give csv: \{skip_rows: 3\}"):
        read_signals(path, take())
    with pytest.raises(
        InputError, match=r"row 1 .*units and sources: give csv: \{below_names: \[units, sources\]\}"
    ):
        read_signals(path, take(csv={"skip_rows": 3}))
    with pytest.raises(
        InputError, match=r"row 2 .* give csv: \{below_names: \[units, sources\]\} .* of units_row"
    ):
        read_signals(path, take(csv={"skip_rows": 3, "units_row": True}))
    whole = {"skip_rows": 3, "below_names": ["units", "sources"]}
    assert read_values(path, take(csv=whole)) == [1.0, 2.0]
    assert read_signals(path, take(csv=whole))["v"].unit == "m/s"


@pytest.mark.parametrize("word", ["-", "--", " - ", "", "nan", "NULL", "N/A", "NaN"])
def test_text_for_no_value_is_no_sample(tmp_path: Path, word: str) -> None:
    assert read_values(write(tmp_path, f"t,v\n0,1\n1,{word}\n2,3\n"), take()) == [1.0, 3.0]


@pytest.mark.parametrize("number", ["-9999", "65535", "65535.0"])
def test_a_number_for_no_value_is_declared_and_is_none_of_the_clock(tmp_path: Path, number: str) -> None:
    path = write(tmp_path, f"t,v\n0,1\n1,{number}\n65535,3\n")
    assert read_values(path, take(csv={"missing": [-9999, 65535]})) == [1.0, 3.0]
    assert read_values(path, take_values({"-9999": None, "65535": None})) == [1.0, 3.0]
    with pytest.raises(InputError, match=r'"n.a.": 1.* null for none'):
        read_signals(write(tmp_path, "t,v\n0,1\n1,n.a.\n2,n.a.\n"), take())
    assert read_values(path.with_name("log.csv"), take(csv={"missing": ["n.a."]})) == [1.0]


def take_values(values: dict[str, float | None]) -> ChannelMap:
    return make_map({"speed": {"source": "v", "unit": "m/s", "values": values}}, time={"source": "t"})


def test_a_switch_is_0_or_1_and_other_text_is_what_the_map_says(tmp_path: Path) -> None:
    assert read_values(write(tmp_path, "t,v\n0,OFF\n1,On\n2,OFF\n"), take()) == [0.0, 1.0, 0.0]
    with pytest.raises(InputError, match=r"row 2 .* 'OFF': .*values: \{\"OFF\": 1\}"):
        read_signals(write(tmp_path, "t,v\n0,12.5\n1,OFF\n2,OFF\n"), take())
    path = write(tmp_path, "t,v\n0,released\n1,pressed\n2,fault\n")
    assert read_values(path, take_values({"released": 0, "pressed": 1, "fault": None})) == [0.0, 1.0]


@pytest.mark.parametrize(
    ("cells", "advice", "option", "value"),
    [
        (("1,066.5", "998"), 'thousands: ","', {"thousands": ","}, 1066.5),
        (("1,066", "1,070"), "where the mark parts thousands, and decimal", {"thousands": ","}, 1066.0),
        (("0,5", "0,75"), "decimal: ','", {"decimal": ","}, 0.5),
    ],
)
def test_advice_on_a_mark_does_not_make_1066_into_1(
    tmp_path: Path, cells: tuple[str, str], advice: str, option: dict[str, str], value: float
) -> None:
    path = write(tmp_path, "t,v\n" + "".join(f'{k},"{cell}"\n' for k, cell in enumerate(cells)))
    with pytest.raises(InputError, match=advice):
        read_signals(path, take())
    assert read_values(path, take(csv=option))[0] == value


@pytest.mark.parametrize(
    ("first", "second", "start", "step"),
    [
        (
            "2026-08-04 13:16:03.000000001+00:00",
            "2026-08-04 13:16:03.049999872+00:00",
            47763.000000001,
            0.049999871,
        ),
        ("2026-08-04T13:16:03+02:00", "2026-08-04T13:16:03.05+02:00", 40563.0, 0.05),
        ("04-Aug-2026 13:16:03.000", "04-Aug-2026 13:16:03.050", 47763.0, 0.05),
        ("13:16:03", "13:16:03.05", 47763.0, 0.05),
        ("23:59:59.95", "00:00:00.05", 86399.95, 0.1),
        ("12:00:00.5 AM", "12:00:01.5 AM", 0.5, 1.0),
        ("59:59.9", "00:00.1", 3599.9, 0.2),
    ],
)
def test_a_clock_of_dates_or_times_of_day_is_one(
    tmp_path: Path, first: str, second: str, start: float, step: float
) -> None:
    times = read_times(write(tmp_path, f"t,v\n{first},1\n{second},2\n"), take())
    np.testing.assert_allclose([times[0], times[1] - times[0]], [start, step], rtol=0, atol=1e-10)


@pytest.mark.parametrize(
    "kind", [pa.timestamp("ns", "UTC"), pa.timestamp("us"), pa.time64("ns"), pa.duration("ms")]
)
def test_a_clock_of_parquet_has_any_type_of_time(tmp_path: Path, kind: pa.DataType) -> None:
    per_second = {"ns": 10**9, "us": 10**6, "ms": 10**3}[kind.unit]
    stamps = pa.array([3 * per_second, 3 * per_second + per_second // 20, None], pa.int64()).cast(kind)
    pq.write_table(pa.table({"t": stamps, "v": [1.0, 2.0, 3.0]}), tmp_path / "log.parquet")
    assert read_times(tmp_path / "log.parquet", take()) == [3.0, 3.05]
    with pytest.raises(InputError, match=r"dates or times, which have no unit.* leave unit: ms away"):
        read_signals(tmp_path / "log.parquet", take(time={"source": "t", "unit": "ms"}))


@pytest.mark.parametrize("day", [46238.0, 740199.0])
def test_days_of_a_spreadsheet_or_datenum_count_from_midnight(tmp_path: Path, day: float) -> None:
    path = write(tmp_path, f"t,v\n{day + 0.25:.12f},1\n{day + 0.25 + 1 / 86400:.12f},2\n")
    np.testing.assert_allclose(
        read_times(path, take(time={"source": "t", "unit": "d"})), [21600.0, 21601.0], atol=2e-5
    )


def test_a_clock_that_begins_again_is_told_with_its_row(tmp_path: Path) -> None:
    path = write(tmp_path, "t,v\n0,1\n5,2\n9,3\n0,4\n5,5\n")
    with pytest.raises(
        InputError, match=r"clock t begins again at row 4 below the names, first from 9.000 to 0.000 s"
    ):
        read_signals(path, take())


def test_a_table_out_of_bounds_is_refused_before_it_is_read(tmp_path: Path) -> None:
    names = [f"c{k}" for k in range(MOST_COLUMNS + 1)]
    with pytest.raises(InputError, match=f"at most {MOST_COLUMNS} columns"):
        read_signals(write(tmp_path, ",".join(names) + "\n"), take())
    for length, words in (
        (LONGEST_COLUMN + 1, "names of at most"),
        (2_000_000, "names of at most|must be a table"),
    ):
        with pytest.raises(InputError, match=words) as caught:
            read_signals(write(tmp_path, "t,v," + "x" * length + "\n0,1,2\n"), take())
        assert len(str(caught.value)) < 500
    pq.write_table(pa.table({"t": pa.nulls(MOST_SAMPLES + 1, pa.int8())}), tmp_path / "long.parquet")
    with pytest.raises(InputError, match=f"at most {MOST_SAMPLES} samples"):
        summarise_signals(tmp_path / "long.parquet", None)
    pq.write_table(pa.table({"t": [0.0], "x" * (LONGEST_COLUMN + 1): [1.0]}), tmp_path / "name.parquet")
    with pytest.raises(InputError, match="names of at most"):
        summarise_signals(tmp_path / "name.parquet", None)


def test_parquet_of_others_is_read_without_a_thread_of_arrow(tmp_path: Path) -> None:
    """One that outlives the interpreter aborts it: exit code 134 in the place of 2."""
    import subprocess
    import sys

    pq.write_table(pa.table({"t": np.arange(9.0), "v": np.arange(9.0)}), tmp_path / "log.parquet")
    code = (
        "import os; from pathlib import Path; from catalogs.campaign_files import parse_columns\n"
        "before = len(os.listdir('/proc/self/task'))\n"
        f"parse_columns(Path({str(tmp_path / 'log.parquet')!r}).read_bytes(), 'log', ['t', 'v'])\n"
        "print(len(os.listdir('/proc/self/task')) - before)"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "0"
