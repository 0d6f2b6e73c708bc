"""A dataset's own tables decide what it has: a column that came later is not represented, and nothing is refused."""

import json
import tarfile

import numpy as np
import pyarrow.parquet as pq
import pytest

import musync
from flows.auditing.audit import audit_dataset
from flows.auditing.dataset_diff import compare_datasets
from flows.auditing.explain import explain_frame
from flows.exporting.export import export_dataset
from flows.reading.query import query_dataset
from flows.reading.report import make_report
from flows.store.layout import Layout
from flows.store.telemetry import read_columns
from studies.lineage import trace as lineage
from studies.physics_judge.audit_physics import audit_physics
from tests.flows.older import make_older

LATER = (
    "road_force", "recovered_progress", "peak_pitch_p05", "wheel_lift_time_f", "peak_slip", "check_heave_gain",
    "surface_friction_change",
)  # fmt: skip
"""Of ticks, frames, clips, the pose check and pairs."""


@pytest.fixture(scope="module")
def older(toy_dataset, tmp_path_factory) -> Layout:
    return make_older(toy_dataset, tmp_path_factory.mktemp("older") / "data", LATER)


def test_a_column_that_came_later_is_null_in_every_view_and_library(older):
    asked = {
        "clips": LATER[2:6],
        "ticks": LATER[:1],
        "frames": LATER[:2],
        "verdicts": LATER[5:6],
        "pairs": LATER[6:],
    }
    data = musync.open(older.root)
    for view, names in asked.items():
        counts = ", ".join(f"count({name})" for name in names)
        row = query_dataset(str(older.root), f"SELECT {counts}, count(*) AS rows FROM {view}")["rows"][0]
        assert row.pop("rows") > 0 and set(row.values()) == {0}, view
        assert data.pandas(view, list(names)).isna().all(axis=None)
        if view != "verdicts":
            stored = data.telemetry(view).to_table(columns=list(names))
            assert all(stored[name].null_count == len(stored) > 0 for name in names)
    data.connection.close()
    assert data["dry/flat"].figures.get("peak_slip") is None


def test_an_older_dataset_is_exported_without_what_it_does_not_have(older, tmp_path):
    export_dataset(str(older.root), "lerobot", out=str(tmp_path / "lerobot"), clips=["dry/flat"])
    features = json.loads((tmp_path / "lerobot" / "meta" / "info.json").read_text())["features"]
    state = features["observation.state"]["names"]
    assert "road_force" not in state and "speed" in state
    export_dataset(str(older.root), "webdataset", out=str(tmp_path / "web"), clips=["dry/flat"])
    with tarfile.open(next((tmp_path / "web").glob("*.tar"))) as tar:
        member = next(name for name in tar.getnames() if name.endswith(".json"))
        told = json.loads(tar.extractfile(member).read())["telemetry"]
    assert told["road_force"] is None and told["speed"] > 0


def test_an_older_dataset_is_audited_by_the_columns_that_it_has(older):
    result = audit_dataset(str(older.root), share=0.25, seed=2, runner="threads", workers=1)
    assert result["verified"], (result["mismatches"], result["contradictions"], result["not_remade"])


def test_a_column_of_an_older_dataset_that_is_another_is_still_found(toy_dataset, tmp_path):
    forged = make_older(toy_dataset, tmp_path / "data", LATER, lambda ticks: ticks["heave"].__iadd__(1e-6))
    result = audit_dataset(str(forged.root), share=1.0, runner="threads", workers=1)
    assert {(row["stage"], row["channel"]) for row in result["mismatches"]} == {("vehicle", "heave")}


def test_other_readers_take_an_older_dataset_as_it_is(older, toy_dataset, tmp_path, monkeypatch):
    """A lineage drives the clip as often as there are lines, whatever the tables hold: none is changed here."""
    monkeypatch.setattr(lineage, "move_lines", lambda *given: [])
    assert make_report(str(older.root), out=str(tmp_path / "report"))["traced"] == 4
    result = audit_physics(str(older.root))
    assert result["verified"], [row["broken"] for row in result["clips"]]
    assert explain_frame(str(older.root), "dry/hump", 3)["agrees"]
    assert lineage.trace_lineage(str(older.root), "dry/flat")["follows"]
    row = compare_datasets(str(older.root), str(toy_dataset.root))["clips"][0]
    assert row["first"]["channel"] == "road_force" and row["labels"]["speed_rms_m_s"] == 0


def test_a_table_without_a_column_of_every_dataset_is_refused(toy_dataset, tmp_path):
    broken = make_older(toy_dataset, tmp_path / "data", ("speed",))
    with pytest.raises(musync.InputError, match="lacks speed"):
        export_dataset(str(broken.root), "tum", out=str(tmp_path / "tum"), clips=["dry/flat"])


def test_null_is_nan_again_where_science_reads_it(toy_dataset, older):
    clip = json.loads(toy_dataset.manifest.read_text())["clips"][0]["clip_id"]
    new, old = (
        read_columns(layout.telemetry / "frames", clip, ["road_force"], most=11)
        for layout in (toy_dataset, older)
    )
    assert pq.read_table(toy_dataset.telemetry / "frames")["recovered_pitch"].type == "double"
    assert np.isnan(old["road_force"]).all() and np.isfinite(new["road_force"]).all()
    for name in old.keys() - {"road_force"}:
        np.testing.assert_array_equal(old[name], new[name], strict=True)
