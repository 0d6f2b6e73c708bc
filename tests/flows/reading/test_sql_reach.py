"""A query reaches the dataset's recorded tables, to read, and nothing else unless it is allowed."""

import hashlib
import os
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq
import pytest

import flows.reading.query
import musync
from flows.reading.connection import connect_views
from flows.reading.query import query_dataset
from flows.reading.table_files import _TableFile
from flows.store.layout import Layout
from manifests.provenance import SOURCE_ROOT
from tasks.errors import InputError
from tests.flows.reseal import reseal

PART = "musync://ticks/family=dry/part-0000.parquet"


@pytest.fixture
def copy(toy_dataset, tmp_path) -> Layout:
    shutil.copytree(toy_dataset.root, tmp_path / "copy")
    return Layout(tmp_path / "copy")


def hashes(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.mark.parametrize(
    "query",
    [
        "SELECT * FROM read_text('/etc/hostname')",
        "SELECT * FROM read_csv('/etc/passwd')",
        "SELECT * FROM '/etc/passwd.csv'",
        "SELECT * FROM glob('/home/*')",
        "SELECT * FROM read_text('file:///etc/hostname')",
        "SELECT * FROM read_blob('{dataset}/manifest.json')",
        "SELECT * FROM read_parquet('{dataset}/telemetry/clips.parquet')",
        "SELECT * FROM read_text('musync://clips.parquet/../../manifest.json')",
        "SELECT * FROM query('SELECT * FROM read_text(''/etc/hostname'')')",
        "COPY clips TO '{outside}/stolen.csv'",
        "WITH w AS (COPY (SELECT 1) TO '{outside}/stolen.csv') SELECT 1",
        "EXPORT DATABASE '{outside}/everything'",
        "ATTACH '{outside}/new.db'",
        "INSTALL httpfs",
        "LOAD httpfs",
        "SET memory_limit = '1TB'",
        "SET enable_external_access = true",
        "PRAGMA enable_profiling = 'json'",
        "CALL enable_logging(storage = 'file', storage_path = '{outside}/log')",
    ],
)
def test_a_query_reaches_no_file_of_the_machine_and_says_what_would_let_it(toy_dataset, tmp_path, query):
    asked = query.format(dataset=toy_dataset.root, outside=tmp_path)
    with pytest.raises(InputError, match="--allow-files lets SQL read and write files of this machine"):
        query_dataset(str(toy_dataset.root), asked)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("allowed", [False, True])
@pytest.mark.parametrize(
    "query",
    [
        f"COPY (SELECT 1) TO '{PART}' (FORMAT parquet, USE_TMP_FILE false)",
        f"COPY (SELECT 1) TO '{PART}' (FORMAT csv, USE_TMP_FILE false)",
        f"COPY (SELECT 1) TO '{PART}' (FORMAT parquet)",
        f"WITH w AS (COPY (SELECT 1) TO '{PART}' (USE_TMP_FILE false)) SELECT 1",
        "COPY (SELECT 1) TO 'musync://clips.parquet' (FORMAT csv, USE_TMP_FILE false)",
        "COPY (SELECT 1) TO 'musync://new.parquet'",
    ],
)
def test_no_query_writes_to_the_dataset_through_the_views_files(copy, query, allowed):
    before = hashes(copy.root)
    with pytest.raises(InputError) as caught:
        query_dataset(str(copy.root), query, allow_files=allowed)
    assert "Traceback" not in str(caught.value)
    assert hashes(copy.root) == before


def test_files_are_read_and_written_where_they_are_allowed(toy_dataset, tmp_path):
    (tmp_path / "notes.txt").write_text("speed bump at 4 m")
    answer = query_dataset(
        str(toy_dataset.root), f"SELECT content FROM read_text('{tmp_path}/notes.txt')", allow_files=True
    )
    assert answer["rows"] == [{"content": "speed bump at 4 m"}]
    data = musync.open(toy_dataset.root, allow_files=True)
    data.sql(f"COPY (SELECT label FROM clips) TO '{tmp_path}/labels.csv'")
    assert "dry/hump" in (tmp_path / "labels.csv").read_text()
    with pytest.raises(InputError, match=r"allow_files=True\) lets SQL"):
        musync.open(toy_dataset.root).sql(f"SELECT * FROM read_text('{tmp_path}/notes.txt')")


@pytest.mark.parametrize(
    ("query", "count"),
    [("", 0), (" ; ", 0), ("-- nothing", 0), ("SELECT 1; SELECT 2", 2), ("SELECT 1;", None)],
)
def test_a_question_is_one_statement(toy_dataset, query, count):
    """Of two, the first one's rows would go without a word; none gave an empty answer."""
    if count is None:
        assert query_dataset(str(toy_dataset.root), query)["rows"] == [{"1": 1}]
        return
    with pytest.raises(InputError, match=f"must be one SQL statement; it holds {count}"):
        query_dataset(str(toy_dataset.root), query)
    if count > 1:
        assert query_dataset(str(toy_dataset.root), query, allow_files=True)["rows"] == [{"2": 2}]


def test_a_query_sees_no_variables_of_python(toy_dataset):
    secret = pd.DataFrame({"password": ["1234"]})
    data = musync.open(toy_dataset.root)
    with pytest.raises(InputError, match="secret"):
        data.sql("SELECT * FROM secret")
    data.connection.register("mine", secret)  # by name, and on purpose
    assert data.sql("SELECT * FROM mine").fetchall() == [("1234",)]


def test_sql_hidden_in_a_column_name_is_a_name(copy, tmp_path):
    name = f"""a" , 1) AS "a") FROM (SELECT 1 AS a); COPY (SELECT 1) TO '{tmp_path}/PWNED.sh'; --"""
    for path in (copy.telemetry / "clips.parquet", *copy.telemetry.glob("frames/*/*.parquet")):
        stored = pq.read_table(path, partitioning=None)
        pq.write_table(stored.append_column(name, [[0.5] * stored.num_rows]), path)
    reseal(copy)
    rows = query_dataset(str(copy.root), "SELECT * FROM clips")["rows"]
    data = musync.open(copy.root)
    assert rows[0][name] == 0.5 == data.pandas("clips", [name])[name][0]
    assert data.pandas("frames").shape[0] == 44
    with pytest.raises(InputError):
        data.pandas("clips", [f"label\" FROM clips; COPY clips TO '{tmp_path}/PWNED.sh'; SELECT \"label"])
    assert not (tmp_path / "PWNED.sh").exists()


def test_a_folder_s_name_means_nothing_to_sql(toy_dataset, tmp_path):
    for name in ("a[b]c", "a*c", "it's {1,2}?", 'say "x"; --'):
        folder = shutil.copytree(toy_dataset.root, tmp_path / name / "data")
        assert query_dataset(str(folder), "SELECT count(*) n FROM ticks")["rows"] == [{"n": 4004}]
        assert musync.open(folder).telemetry("ticks").count_rows() == 4004


def test_a_file_that_the_manifest_does_not_record_is_not_read(copy):
    for table in ("ticks", "frames"):
        part = copy.telemetry / table / "family=dry" / "part-0000.parquet"
        shutil.copyfile(part, part.with_name("part-0001.parquet"))
    assert query_dataset(str(copy.root), "SELECT count(*) n FROM ticks")["rows"] == [{"n": 4004}]
    data = musync.open(copy.root)
    assert data.telemetry("ticks").count_rows() == 4004
    assert len(data.torch(window=11, arrays=[], quarantined=True)) == 4


def test_a_query_uses_half_of_the_memory_and_no_disk(toy_dataset):
    with (
        connect_views(toy_dataset.root) as closed,
        connect_views(toy_dataset.root, allow_files=True) as opened,
    ):
        asked = "SELECT current_setting('temp_directory'), current_setting('memory_limit')"
        [(aside, memory)] = closed.execute(asked).fetchall()
        assert aside == "" and opened.execute(asked).fetchall()[0][0] != ""
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    number, unit = memory.split()
    assert unit != "GiB" or float(number) <= total / 2 + 0.1


def test_an_answer_too_large_to_return_is_refused(toy_dataset, monkeypatch):
    monkeypatch.setattr(flows.reading.query, "MOST_VALUES", 8)
    assert len(query_dataset(str(toy_dataset.root), "SELECT clip_id, label FROM clips")["rows"]) == 4
    with pytest.raises(InputError, match="at most 8 values"):
        query_dataset(str(toy_dataset.root), "SELECT clip_id, label, weather FROM clips")


def test_a_query_without_end_is_ended_by_ctrl_c(toy_dataset):
    query = "SELECT sum(a.range * b.range) FROM range(1000000000) a, range(1000000000) b"
    code = (
        "import signal, sys; from flows.reading import query\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # a shell's background job ignores it
        "run = query.run_interruptibly\n"
        "query.run_interruptibly = lambda *asked: print('asks', flush=True) or run(*asked)\n"
        "try: query.query_dataset(sys.argv[1], sys.argv[2])\n"
        "except KeyboardInterrupt: print('ended')"
    )
    asking = subprocess.Popen(
        [sys.executable, "-c", code, toy_dataset.root, query],
        stdout=subprocess.PIPE,
        text=True,
        cwd=SOURCE_ROOT,
    )
    try:
        assert asking.stdout is not None and asking.stdout.readline() == "asks\n"
        with pytest.raises(subprocess.TimeoutExpired):
            asking.wait(1)
        asking.send_signal(signal.SIGINT)
        assert asking.communicate(timeout=60)[0] == "ended\n"
    finally:
        asking.kill()


def test_two_threads_read_one_open_file_each_at_its_own_place(tmp_path):
    (tmp_path / "bytes").write_bytes(bytes(range(100)))
    file = _TableFile(tmp_path / "bytes")
    file.seek(10)
    other = threading.Thread(target=lambda: (file.seek(90), file.read(5)))
    other.start()
    other.join()
    assert file.read(2) == bytes([10, 11]) and file.tell() == 12
    assert file.seek(-1, os.SEEK_END) == 99 and file.read() == bytes([99])
