"""Parquet from a stranger: names are names, objects stay data, and every reader ends in numbers or a sentence."""

import pickle
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from tests.flows.reseal import reseal
from tests.hostile.stage import Stage, endure, refused, unrefused
from tests.hostile.test_frames import Payload

READS_TABLES = ("sql", "open tables", "open windows", "explain", "audit-physics", "sheets")


def tables(stage: Stage) -> Iterator[Path]:
    yield from sorted(stage.dataset.telemetry.rglob("*.parquet"))


def change_all(stage: Stage, alter: Callable[[pa.Table], pa.Table]) -> None:
    for path in tables(stage):
        pq.write_table(alter(pq.read_table(path, partitioning=None)), path)


def typed(table: pa.Table, name: str, kind: pa.DataType, value: object) -> pa.Table:
    """The table with a column, in place of one of that name, of another type."""
    column = pa.array([value] * table.num_rows, kind)
    place = table.schema.get_field_index(name)
    return table.append_column(name, column) if place < 0 else table.set_column(place, name, column)


def pickled_type(stage: Stage) -> None:
    """An extension type as old pyarrow loaded it: from a pickle in the field's metadata."""
    payload = pickle.dumps(Payload(stage.victim / "PWNED"))
    metadata = {b"ARROW:extension:name": b"arrow.py_extension_type", b"ARROW:extension:metadata": payload}

    def alter(table: pa.Table) -> pa.Table:
        field = pa.field("evil", pa.int64(), metadata=metadata)
        return table.append_column(field, pa.array([1] * table.num_rows))

    change_all(stage, alter)


def sql_of(place: Path) -> str:
    return f"""a" , 1) AS "a") FROM (SELECT 1 AS a); COPY (SELECT 1) TO '{place}'; ATTACH '{place}.db'; --"""


TABLES: dict[str, Callable[[Stage], object]] = {
    "SQL in a column's name": lambda s: change_all(
        s, lambda t: typed(t, sql_of(s.victim / "PWNED.sh"), pa.float64(), 0.5)
    ),
    "SQL in place of every name": lambda s: change_all(
        s, lambda t: t.rename_columns([f"{name}{sql_of(s.victim / 'PWNED.sh')}" for name in t.column_names])
    ),
    "a type that is a pickle": pickled_type,
    "numbers as text": lambda s: change_all(s, lambda t: typed(t, "speed", pa.string(), "fast")),
    "numbers that are none": lambda s: change_all(s, lambda t: typed(t, "speed", pa.float64(), None)),
    "ids that are numbers": lambda s: change_all(s, lambda t: typed(t, "clip_id", pa.int64(), 7)),
    "no rows": lambda s: change_all(s, lambda t: t.slice(0, 0)),
    "half of the rows": lambda s: change_all(s, lambda t: t.slice(0, t.num_rows // 2)),
    "no columns of ours": lambda s: change_all(s, lambda t: pa.table({"x": [1.0]})),
    "columns twice": lambda s: change_all(
        s, lambda t: t.append_column("speed", pa.array([1.0] * t.num_rows))
    ),
    "no Parquet": lambda s: [
        path.write_bytes(b"PAR1" + bytes(50) + b"\xff\xff\xff\x7fPAR1") for path in tables(s)
    ],
    "noise in the middle": lambda s: [
        path.write_bytes(path.read_bytes()[:900] + bytes(400) + path.read_bytes()[1300:])
        for path in tables(s)
    ],
}


UNREADABLE = {
    "SQL in place of every name", "no columns of ours", "columns twice", "no Parquet",
}  # fmt: skip
"""Tables that every reader refuses."""
UNPHYSICAL = {
    "numbers as text", "numbers that are none", "ids that are numbers", "half of the rows", "noise in the middle",
}  # fmt: skip
"""Tables that some readers take, as their form is right: the audit of the physics does not."""


@pytest.mark.parametrize("attack", TABLES)
def test_tables_with(stage, attack):
    TABLES[attack](stage)
    reseal(stage.dataset)
    outcomes = endure(stage, *READS_TABLES)
    if attack in UNREADABLE:
        assert unrefused(outcomes) == []
    if attack in UNPHYSICAL:
        assert refused(outcomes["audit-physics"])


@pytest.mark.parametrize(
    ("attack", "alter"),
    [
        ("rows", lambda table: pa.concat_tables([table] * 120)),
        ("characters in a column's name", lambda table: typed(table, "x" * 2_000_000, pa.bool_(), True)),
    ],
    ids=["rows beyond the plan", "a name of two megabytes"],
)
def test_what_the_footer_tells_beyond_the_plan_is_refused_before_a_row_is_read(stage, attack, alter):
    """Ten megabytes hold a hundred million rows."""
    for path in tables(stage):
        if path.parent.name.startswith("family="):
            pq.write_table(alter(pq.read_table(path, partitioning=None)), path)
    reseal(stage.dataset)
    outcomes = endure(stage, "sql", "open tables", "explain", "audit-physics", "sheets")
    assert {name for name, said in outcomes.items() if attack not in str(said)} == set()
    assert "must have at most" in str(outcomes["audit-physics"])


def test_each_file_of_a_table_is_bounded_before_sql_reads_it(stage):
    *_, last = sorted(stage.dataset.telemetry.glob("frames/family=*/*.parquet"))
    pq.write_table(pa.concat_tables([pq.read_table(last, partitioning=None)] * 120), last)
    reseal(stage.dataset)
    assert "must have at most" in str(endure(stage, "sql")["sql"])


def test_folders_and_files_that_the_manifest_does_not_name_are_no_tables(stage):
    part = stage.dataset.telemetry / "ticks" / "family=dry" / "part-0000.parquet"
    for family in ("family=../../victim", "family='; ATTACH 'x", "family=dry", "family=a=b"):
        folder = stage.dataset.telemetry / "ticks" / family.replace("/", "%2F")
        folder.mkdir(exist_ok=True)
        shutil.copyfile(part, folder / "part-9999.parquet")
    outcomes = endure(stage, *READS_TABLES)
    assert outcomes["sql"]["rows"][0]["n"] == 20  # four clips of five frames
