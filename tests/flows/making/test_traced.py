"""`musync generate --poses`: clips that show the motion of reference traces, sealed and made again like any other."""

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from catalogs.reference_match import find_case, list_differences
from catalogs.references import ReferenceCase
from catalogs.scenario import Scenario
from flows.auditing.audit import audit_dataset
from flows.auditing.explain import explain_frame
from flows.making.request import make_dataset
from flows.reading.query import query_dataset
from studies.lineage.trace import trace_lineage
from studies.negative_controls.study import run_controls
from studies.physics_judge.audit_physics import audit_physics, clip_columns, clip_facts
from tasks.errors import InputError
from tasks.eval.state_agreement import WHEELS
from tasks.vehicle.replayed_trace import replay_trace
from tests.toy_street import write_toy_grid

GRID = """
name: traced
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 9
frame_rate_hz: 10
scenarios:
  hump: {{weather: dry, initial_speed_km_h: 40, hazard_center_m: 6, hazard_length_m: 2, hazard_height_m: 0.08}}
"""
HUMP = {
    "case": "bump", "weather": "dry", "surface_coefficient": 0.82, "initial_speed_km_h": 40.0,
    "hazard_center_m": 6.0, "hazard_length_m": 2.0, "hazard_height_m": 0.08, "static_pitch_deg": 0.2,
}  # fmt: skip


def trace_columns(end: float = 1.0, final_speed: float = 11.0) -> dict[str, np.ndarray]:
    time = np.arange(0.0, end + 1e-9, 0.01)
    zero = 0.0 * time
    columns = {"time": time, "station": 11 * time, "speed": np.linspace(11.0, final_speed, len(time))}
    columns |= {"pitch": 0.2 + np.sin(3 * time), "cg_height": 0.5 + 0.5 * np.maximum(time - 0.8, 0)}
    columns |= {f"slip_{wheel}": zero + 0.1 * (wheel == "fl") for wheel in WHEELS}
    return columns | {f"wheel_load_{wheel}": zero + 4000 for wheel in WHEELS}


def write_traces(folder: Path, case: dict[str, object], columns: dict[str, np.ndarray]) -> str:
    folder.mkdir()
    pq.write_table(pa.table(columns), folder / f"{case['case']}.parquet")
    (folder / "cases.json").write_text(json.dumps([case]))
    return str(folder)


@pytest.fixture(scope="module")
def traced(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("traced")
    traces = write_traces(folder / "traces", HUMP, trace_columns())
    made = {"runner": "threads", "workers": 1, "backend": "cpu", "poses": traces}
    make_dataset(write_toy_grid(folder, GRID), str(folder / "made"), **made)
    return folder / "made"


def test_a_clip_shows_the_motion_of_its_trace_and_is_made_again_without_it(traced: Path) -> None:
    (facts,) = clip_facts(traced)
    frames = clip_columns(traced, "frames", facts)
    t = np.arange(9) / 10
    np.testing.assert_allclose(frames["station"], 11 * t, atol=1e-9)
    np.testing.assert_allclose(np.rad2deg(frames["pitch"]), np.sin(3 * t), atol=1e-9)
    np.testing.assert_allclose(frames["heave"], 0.5 * np.maximum(t - 0.8, 0), atol=1e-9)
    pose = frames["T_world_rig"].reshape(-1, 4, 4)
    np.testing.assert_allclose(np.arcsin(-pose[:, 2, 0]), frames["pitch"], atol=1e-6)
    assert np.rad2deg(facts["static_pitch"]) == pytest.approx(0.2)
    assert frames["braking_slip_f"][0] == 0.05 and frames["axle_load_r"][0] == 8000
    assert np.isnan(frames["tyre_force_f"]).all() and np.isnan(facts["surface_friction_p50"])
    for path in (traced.parent / "traces").iterdir():
        path.unlink()
    assert audit_dataset(str(traced), share=1.0, runner="threads", workers=1)["verified"]


def test_what_a_trace_does_not_hold_is_null_in_sql(traced: Path) -> None:
    ask = "SELECT count(tyre_force_f) AS known, count(*) FILTER (tyre_force_f > 0) AS braking, count(*) AS rows FROM"
    for view, rows in (("ticks", 801), ("frames", 9)):
        (told,) = query_dataset(str(traced), f"{ask} {view}")["rows"]
        assert told == {"known": 0, "braking": 0, "rows": rows}


def test_commands_that_drive_a_clip_again_refuse_it(traced: Path) -> None:
    place = str(traced)
    for name, run in {
        "lab audit-physics": lambda: audit_physics(place),
        "lab controls": lambda: run_controls(place),
        "explain": lambda: explain_frame(place, "hump", 0),
        "lab lineage": lambda: trace_lineage(place, "hump"),
    }.items():
        with pytest.raises(InputError, match=f"no vehicle model made; musync {name} needs"):
            run()


def test_what_the_traces_do_not_show_is_said_at_once(tmp_path: Path) -> None:
    grid = write_toy_grid(tmp_path, GRID)

    def refused(name: str, case: dict[str, object], columns: dict[str, np.ndarray]) -> str:
        with pytest.raises(InputError) as caught:
            make_dataset(grid, str(tmp_path / "out"), poses=write_traces(tmp_path / name, case, columns))
        assert not (tmp_path / "out").exists()
        return str(caught.value)

    assert "the nearest, bump, differs in hazard_height_m (0.05 there, 0.08 here)" in refused(
        "other", HUMP | {"hazard_height_m": 0.05}, trace_columns()
    )
    assert "bump ends at 0.6 s with 11.00 m/s, before the telemetry ends at 0.8 s" in refused(
        "short", HUMP, trace_columns(end=0.6)
    )
    low = trace_columns()
    del low["cg_height"]
    ahead = trace_columns() | {"station": trace_columns()["station"] - 3}
    assert "bump must drive from station 0 on; it begins at -3.00 m" in refused("ahead", HUMP, ahead)
    assert "bump needs the column cg_height" in refused("low", HUMP, low)
    with pytest.raises(InputError, match="leave out --vehicle, --poses"):
        make_dataset(None, str(tmp_path / "out"), manifest="demo", poses="traces")


def test_a_trace_that_ends_standing_is_held_and_one_that_rolls_on_is_not_known() -> None:
    rest = {
        "surface_friction": 0.8,
        "static_pitch_deg": None,
        "brake_onset_s": 0.1,
        "stopping_distance_m": 3.0,
    }
    stopped = replay_trace(trace_columns(0.5, 0.0), duration_s=1.0, **rest)
    assert len(stopped.columns["t_ns"]) == 1001 and stopped.stop_time == pytest.approx(0.5)
    assert (
        stopped.columns["station"][-1] == stopped.columns["station"][500]
        and stopped.columns["speed"][-1] == 0
    )
    assert stopped.columns["pitch"][0] == 0 and stopped.columns["pitch_rate"][-1] == 0
    rolling = replay_trace(trace_columns(0.5, 5.0), duration_s=1.0, **rest)
    assert (
        np.isfinite(rolling.columns["pitch"][:501]).all() and np.isnan(rolling.columns["pitch"][501:]).all()
    )


def test_a_case_is_found_by_its_conditions_and_by_nothing_else() -> None:
    stop = ReferenceCase(
        case="stop", weather="rain", surface_coefficient=0.347126, initial_speed_km_h=60.0,
        peak_pressure_mpa=2.3, brake_onset_s=1.0,
    )  # fmt: skip
    coast = stop.model_copy(update={"case": "coast", "brake_onset_s": None})
    asked = Scenario(
        weather="rain", precipitation_mm_h=50, initial_speed_km_h=60, peak_pressure_mpa=2.3,
        brake_onset_s=1.0, hold_speed=True,
    )  # fmt: skip
    assert find_case([coast, stop], asked, 0.34713) is stop
    free = Scenario(**{**asked.as_row(), "hold_speed": False})
    assert list_differences(stop, free, 0.34713) == ["hold_speed (True there, False here)"]
    late = Scenario(**{**asked.as_row(), "brake_onset_s": 1.1})
    assert list_differences(stop, late, 0.4) == [
        "surface_coefficient (0.347126 there, 0.4 here)", "brake_onset_s (1 there, 1.1 here)"
    ]  # fmt: skip
    with pytest.raises(InputError, match="several reference cases have these conditions: stop, twin"):
        find_case([stop, stop.model_copy(update={"case": "twin"})], asked, 0.34713)
    twin = stop.model_copy(update={"case": "twin", "precipitation_mm_h": 50.0})
    assert find_case([stop, twin], asked, 0.34713) is twin
