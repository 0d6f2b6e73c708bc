"""A dataset without frames has the telemetry of one with them, and everything that reads datasets reads it."""

import json

import numpy as np
import pyarrow.parquet as pq
import pytest

import musync
from flows.auditing.audit import audit_dataset
from flows.auditing.explain import explain_frame
from flows.auditing.repair import repair_dataset
from flows.auditing.verify import verify_dataset
from flows.making.generate import generate_dataset
from flows.making.plan import make_plan
from flows.reading.describe import describe_dataset
from flows.reading.previews import make_films
from flows.reading.query import query_dataset
from flows.store.layout import Layout
from studies.physics_judge.audit_physics import audit_physics
from tasks.errors import InputError


@pytest.fixture(scope="module")
def bare(toy_dataset, tmp_path_factory) -> Layout:
    folder = tmp_path_factory.mktemp("bare")
    grid = str(toy_dataset.root.parent / "grid.yaml")
    report = generate_dataset(grid, str(folder / "data"), runner="threads", workers=1, pictures=False)
    assert report.quarantined == {}
    return report.layout


def test_telemetry_is_that_of_the_same_grid_with_frames(toy_dataset, bare):
    with_frames, without = (json.loads(x.manifest.read_bytes())["clips"] for x in (toy_dataset, bare))
    assert [c["clip_id"] for c in without] == [c["clip_id"] for c in with_frames]
    assert [c["content"]["ticks"] for c in without] == [c["content"]["ticks"] for c in with_frames]
    ours, theirs = (pq.read_table(x.telemetry / "ticks") for x in (bare, toy_dataset))
    assert ours.equals(theirs, check_metadata=True)


def test_snow_that_reaches_the_camera_is_refused_where_pictures_are_asked_for(tmp_path):
    """Its highest lumps are twice the mean depth: 0.7 m buries a camera 1.4 m above the road."""
    deep = "name: deep\nframes: 2\nframe_rate_hz: 1\nscenarios:\n"
    for label, hours in (("under", 23.3), ("at", 23.4)):
        deep += f"  {label}: {{weather: snow, precipitation_mm_h: 3, snow_accumulation_h: {hours}}}\n"
    (tmp_path / "grid.yaml").write_text(deep)
    with pytest.raises(InputError) as caught:
        make_plan(tmp_path / "grid.yaml", "cpu")
    (problem,) = caught.value.problems
    assert "scenario at: snow must be less than 700 mm deep" in problem and "it is 702 mm" in problem
    assert len(make_plan(tmp_path / "grid.yaml", "cpu", pictures=False)[0].clips) == 2


def test_there_is_no_picture_and_no_verdict(bare):
    assert not bare.frames.exists() and not bare.previews.exists()
    rows = query_dataset(str(bare.root), "SELECT count(*) n, count(check_passed) judged FROM verdicts")[
        "rows"
    ]
    assert rows == [{"n": 4, "judged": 0}]
    recovered = pq.read_table(bare.telemetry / "frames")["recovered_pitch"].to_numpy()
    assert np.isnan(recovered).all()


def test_readers_and_auditors_take_it(bare, tmp_path):
    assert verify_dataset(str(bare.root))["verified"]
    assert audit_dataset(str(bare.root), share=1.0, runner="threads", workers=1)["mismatches"] == []
    assert explain_frame(str(bare.root), "snow-3/hump", 6)["agrees"]
    assert describe_dataset(str(bare.root))["clips"][0]["passed"] is None
    assert audit_physics(str(bare.root))["verified"]
    data = musync.open(bare.root)
    assert data.torch(window=3, columns=["speed"], arrays=[])[1]["telemetry"].shape == (3, 1)
    with pytest.raises(InputError, match="without frames"):
        _ = data.frames
    with pytest.raises(InputError, match="--no-frames"):
        make_films(str(bare.root), str(tmp_path))


def test_a_broken_table_is_repaired(bare):
    path = bare.telemetry / "ticks" / "family=snow" / "part-0000.parquet"
    before = path.read_bytes()
    path.write_bytes(before[:-9])
    assert repair_dataset(str(bare.root), runner="threads", workers=1)["repaired"]
    assert path.read_bytes() == before


def test_the_default_runner_freezes_the_manifest_that_threads_do(toy_dataset, bare, tmp_path):
    """That processes do so too, with frames, is a test of ``test_pipeline.py``."""
    grid = str(toy_dataset.root.parent / "grid.yaml")
    alone = generate_dataset(grid, str(tmp_path / "default"), pictures=False, workers=2).layout
    assert alone.manifest.read_bytes() == bare.manifest.read_bytes()
    assert alone.plan.read_bytes() == bare.plan.read_bytes()


def test_a_clip_that_drives_off_its_route_is_named(toy_dataset, tmp_path):
    grid = tmp_path / "far.yaml"
    text = (toy_dataset.root.parent / "grid.yaml").read_text()
    grid.write_text(text.replace("flat: {initial_speed_km_h: 40", "flat: {initial_speed_km_h: 300"))
    with pytest.raises(InputError) as raised:
        generate_dataset(str(grid), str(tmp_path / "data"), runner="threads", workers=1, pictures=False)
    assert {problem.split(":")[0] for problem in raised.value.problems} == {
        "clip dry/flat",
        "clip snow-3/flat",
    }
