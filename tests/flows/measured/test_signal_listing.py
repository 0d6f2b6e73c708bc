"""import-measurements --list-signals: what a channel map can name, for recordings of every form."""

import json
from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq
import pytest
import yaml
from scipy.io import savemat
from typer.testing import CliRunner

from catalogs.recordings import SUFFIXES
from flows.cli import app
from flows.measured.importing import import_measurements
from tasks.errors import InputError
from tests.campaign.recorded import MAP, braking_columns, log_signal
from tests.catalogs.recordings.written import make_store, write_bag

LOG = log_signal(braking_columns())


def write_logs(folder: Path) -> None:
    """The same log as CSV, Parquet, bus JSON, MATLAB and MCAP."""
    frame = pd.DataFrame(LOG)
    frame.to_csv(folder / "a.csv", index=False)
    frame.to_parquet(folder / "b.parquet")
    bus = {
        n: {"unit": "", "values": [[t, v] for t, v in zip(LOG["t_ms"], x, strict=True)]}
        for n, x in LOG.items()
    }
    (folder / "c.json").write_text(json.dumps(bus))
    savemat(folder / "d.mat", LOG)
    store = make_store()
    number = store.types["std_msgs/msg/Float64"]
    messages = [
        (f"/{name}", 10**18 + round(t * 1e6), number(value))
        for name, values in LOG.items() if name != "t_ms"
        for t, value in zip(LOG["t_ms"], values, strict=True)
    ]  # fmt: skip
    write_bag(folder, "mcap", sorted(messages, key=lambda message: message[1]), store).rename(
        folder / "e.mcap"
    )


def write_map(folder: Path, **changes: object) -> str:
    (folder / "map").mkdir(exist_ok=True)
    (folder / "map" / "map.yaml").write_text(yaml.safe_dump(yaml.safe_load(MAP) | changes))
    return str(folder / "map" / "map.yaml")


def test_every_form_gives_the_same_rows(tmp_path):
    write_logs(tmp_path)
    listed = import_measurements(str(tmp_path), map=write_map(tmp_path), list_signals=True)["signals"]
    assert [Path(file).suffix for file in listed] == [".csv", ".parquet", ".json", ".mat", ".mcap"]
    for file, rows in listed.items():
        row = next(row for row in rows if row["signal"].strip("/").removesuffix(".data") == "v_kmh")
        assert row["samples"] == 401, file
        assert row["rate_hz"] == pytest.approx(100.0), file
        assert (row["start_s"], row["end_s"]) == pytest.approx((0.0, 4.0)), file
        assert (row["lowest"], row["highest"]) == pytest.approx((LOG["v_kmh"].min(), LOG["v_kmh"].max())), (
            file
        )


@pytest.mark.parametrize("form", ["d.mat", "e.mcap"])
def test_matlab_and_mcap_become_the_campaign_that_the_csv_becomes(tmp_path, form):
    write_logs(tmp_path)
    topics = yaml.safe_load(MAP)["channels"]
    if form == "e.mcap":
        for entry in topics.values():
            names = [entry["source"]] if isinstance(entry["source"], str) else entry["source"]
            entry["source"] = [f"/{name}.data" for name in names]
    tables = []
    for file, channels in (("a.csv", yaml.safe_load(MAP)["channels"]), (form, topics)):
        out = tmp_path / "out" / file
        import_measurements(str(tmp_path / file), map=write_map(tmp_path, channels=channels), out=str(out))
        tables.append(pq.read_table(next((out / "runs").iterdir())).to_pandas())
    pd.testing.assert_frame_equal(*tables, rtol=0.0, atol=1e-6)


def test_a_bag_folder_becomes_one_run_whose_files_are_recorded(tmp_path):
    write_logs(tmp_path)
    (tmp_path / "drive" / "made.mcap").write_bytes((tmp_path / "e.mcap").read_bytes())
    channels = yaml.safe_load(MAP)["channels"]
    for entry in channels.values():
        names = [entry["source"]] if isinstance(entry["source"], str) else entry["source"]
        entry["source"] = [f"/{name}.data" for name in names]
    report = import_measurements(
        str(tmp_path / "drive"), map=write_map(tmp_path, channels=channels), out=str(tmp_path / "out")
    )
    assert [(run["run"], run["file"]) for run in report["runs"]] == [("drive", "drive")]
    assert set(report["sources"]) == {"drive/made.mcap"}


def test_tables_need_no_map_but_have_no_rate_without_one(tmp_path):
    write_logs(tmp_path)
    (rows,) = import_measurements(str(tmp_path / "a.csv"), list_signals=True)["signals"].values()
    assert {row["signal"] for row in rows} == set(LOG) and {row["rate_hz"] for row in rows} == {None}


def test_the_command_prints_a_table_for_each_recording(tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "140")
    write_logs(tmp_path)
    result = CliRunner().invoke(app, ["import-measurements", str(tmp_path), "--list-signals"])
    assert result.exit_code == 0, result.exception
    assert all(file in result.output for file in ("a.csv", "b.parquet", "c.json", "d.mat", "e.mcap"))
    assert "/v_kmh.data" in result.output and "0 to 4" in result.output
    assert list(tmp_path.glob("**/campaign.yaml")) == []


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_recording_that_cannot_be_read_is_a_sentence(tmp_path, suffix):
    if suffix in (".mf4", ".mdf"):
        pytest.importorskip("asammdf", reason="reading MDF4 needs asammdf")
    (tmp_path / f"log{suffix}").write_bytes(b"\x00\x01\xff not what it says")
    with pytest.raises(InputError) as caught:
        import_measurements(str(tmp_path), list_signals=True)
    assert all(problem.count("\n") == 0 for problem in caught.value.problems)
