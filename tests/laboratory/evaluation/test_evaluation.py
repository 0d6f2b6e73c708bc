"""`musync lab evaluate` end to end on a toy dataset: every figure is a number with its note, or says why not."""

import json
import shutil
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from flows.making.catalogue import catalogue_of
from flows.making.generate import generate_dataset
from studies.evaluation import evaluation
from studies.evaluation.commands import shorten_evaluation
from studies.evaluation.evaluation import NOT_RUN, evaluate_dataset
from studies.physics_judge.audit_physics import clip_columns, clip_facts
from tasks.errors import InputError
from tasks.eval.state_agreement import WHEELS
from tests.laboratory.foreign_video.test_trajectories import tum_lines
from tests.toy_street import write_toy_grid

GRID = """
name: judged
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 31
frame_rate_hz: 10
axes:
  weather:
    dry: {{weather: dry}}
    snow-1: {{weather: snow, precipitation_mm_h: 1, snow_accumulation_h: 1}}
    snow-3: {{weather: snow, precipitation_mm_h: 3, snow_accumulation_h: 1}}
  road:
    flat: {{initial_speed_km_h: 30}}
    hump: {{initial_speed_km_h: 30, hazard_center_m: 9.0, hazard_length_m: 2.0, hazard_height_m: 0.08}}
"""


@pytest.fixture(scope="module")
def judged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("judged")
    generate_dataset(
        write_toy_grid(folder, GRID), str(folder / "made"), runner="threads", workers=1, backend="cpu"
    )
    write_true_trajectories(folder / "made", folder / "told" / "truth")
    write_reference(folder / "made", folder / "reference")
    evaluate_dataset(
        str(folder / "made"),
        out=str(folder / "out"),
        trajectories=str(folder / "told"),
        metric=True,
        reference=str(folder / "reference"),
    )
    return folder / "out"


def write_true_trajectories(dataset: Path, told: Path) -> None:
    told.mkdir(parents=True)
    mount = catalogue_of(dataset.resolve()).camera.T_rig_camera
    for facts in clip_facts(dataset):
        frames = clip_columns(dataset, "frames", facts)
        poses = frames["T_world_rig"].reshape(-1, 4, 4) @ mount
        lines = tum_lines(frames["t_ns"] * 1e-9, poses)
        (told / f"{facts['clip_id']}.txt").write_text(lines)


def write_reference(dataset: Path, folder: Path) -> None:
    """Traces of every clip but two: its own telemetry with 1.25 times the pitch, in snow 3 % less way at the end."""
    folder.mkdir()
    rows = []
    for facts in clip_facts(dataset):
        if facts["label"].startswith("snow-1"):
            continue
        ticks = clip_columns(dataset, "ticks", facts)
        time = ticks["t_ns"] * 1e-9
        slower = 1 - 0.03 * time / time[-1] * (facts["weather"] == "snow")
        columns = {"time": time, "station": ticks["station"] * slower, "speed": ticks["speed"]}
        columns["pitch"] = np.rad2deg(1.25 * ticks["pitch"]) + 0.15
        columns |= {
            f"{name}_{wheel}": load + 0 * time
            for name, load in (("slip", 0.0), ("wheel_load", 4e3))
            for wheel in WHEELS
        }
        name = facts["label"].replace("/", "-")
        pq.write_table(pa.table(columns), folder / f"{name}.parquet")
        keys = ("weather", "initial_speed_km_h", "hazard_center_m", "hazard_length_m", "hazard_height_m")
        rows.append({key: facts[key] for key in keys} | {"case": name})
        rows[-1]["surface_coefficient"] = round(facts["surface_friction"], 6)
    (folder / "cases.json").write_text(json.dumps(rows))


def test_the_terminal_shows_the_means_over_all_clips_and_what_lacks(judged: Path) -> None:
    shown = shorten_evaluation(json.loads((judged / "evaluation.json").read_text()))
    assert {row["condition"] for row in shown["rows"]} == {"all", "paper/dry-features"}
    assert all(row["value"] is not None for row in shown["rows"])
    assert any(row["metric"] == "pitch_rmse" and row["method"] == "essential" for row in shown["rows"])
    assert any(line.startswith("fast_vqa (not run") for line in shown["lacking"])


def test_the_terminal_shows_the_rows_of_a_single_clip_where_there_are_no_means() -> None:
    columns = {"metric": "pitch_mae", "method": "pnp", "unit": "deg", "paper": None, "note": ""}
    row = columns | {"condition": "snow-3/flat", "value": 0.1, "window": False}
    shown = shorten_evaluation({"clips": 1, "rows": [row, row | {"window": True}]})
    assert [row["condition"] for row in shown["rows"]] == ["snow-3/flat"]


def test_every_metric_has_rows_and_a_row_without_a_value_says_why(judged: Path) -> None:
    rows = json.loads((judged / "evaluation.json").read_text())["rows"]
    names = {row["metric"] for row in rows}
    assert {"pitch_rmse", "e_weather", "e_geometry_hump", "e_path", "localised_edit_rate", "temporal_iou",
            "anchor_error", "edit_outside", "severity_rank_correlation", "piqe", "temporal_error", "twin_ssim",
            "twin_flip", *NOT_RUN} <= names  # fmt: skip
    assert all(row["note"] for row in rows if row["value"] is None)
    edits = [row for row in rows if row["method"] == "paired-lab" and row["averaged"] is None]
    assert edits and all(row["floor"] is not None for row in edits if row["value"] is not None)
    assert {row["method"] for row in rows if row["metric"] == "pitch_rmse"} == {
        "photometric",
        "pnp",
        "essential",
        "truth",
    }


def test_a_trajectory_from_outside_is_scored_by_the_same_code(judged: Path) -> None:
    rows = [r for r in json.loads((judged / "evaluation.json").read_text())["rows"] if r["method"] == "truth"]
    assert {"pitch_rmse", "progress_rmse", "e_weather", "e_path", "e_geometry_hump"} <= {
        r["metric"] for r in rows
    }
    assert max(r["value"] for r in rows if r["metric"] == "pitch_rmse") < 1e-4
    exact = [r for r in rows if r["metric"] == "e_geometry_hump"]
    assert exact and all(r["value"] == pytest.approx(r["floor"], abs=1e-3) for r in exact)
    assert all(r["uncertainty"] is None for r in rows)


def test_an_edit_changes_nothing_off_the_feature_before_the_car_meets_it(judged: Path) -> None:
    rows = json.loads((judged / "evaluation.json").read_text())["rows"]
    alike = [row for row in rows if row["metric"] == "twin_ssim" and row["averaged"] is None]
    assert len(alike) == 3 and all(row["value"] > 0.999 for row in alike)


def test_geometry_stands_at_four_windows_beside_its_floor(judged: Path) -> None:
    rows = json.loads((judged / "evaluation.json").read_text())["rows"]
    mine = [row for row in rows if row["metric"] == "e_geometry_hump" and row["method"] == "pnp"]
    assert {row["window"] for row in mine} == {0, 5, 7, 9}
    floors = {row["window"]: row["floor"] for row in mine}
    assert floors[0] == 0 and floors[5] < floors[7] < floors[9]


def test_the_table_and_the_page_hold_the_same_figures(judged: Path) -> None:
    rows = json.loads((judged / "evaluation.json").read_text())["rows"]
    table = pq.read_table(judged / "evaluation.parquet")
    assert table.num_rows == len(rows)
    assert table["value"].to_pylist() == [row["value"] for row in rows]
    html = (judged / "evaluation.html").read_text()
    titles = ("snow-3/flat, less dry", "dry/hump", "Response to weather and road")
    assert html.count('class="plot"') == 4 and all(html.count(title) >= 1 for title in titles)
    assert 'src="http' not in html and "<script src" not in html
    assert "not run: checkpoint missing" in html
    assert all(f">{name}</td>" in html for name in ("paper/dry-features", "snow-3/all"))


def test_the_paper_stands_beside_the_mean_over_its_clips_and_beside_no_single_clip(judged: Path) -> None:
    rows = json.loads((judged / "evaluation.json").read_text())["rows"]
    printed = [row for row in rows if row["paper"] is not None]
    assert printed and all(row["condition"].startswith("paper/") for row in printed)
    mine = {row["condition"]: row for row in rows if row["metric"] == "e_geometry_hump"
            and row["method"] == "truth" and row["window"] == 5}  # fmt: skip
    assert set(mine) == {"dry/hump", "snow-1/hump", "snow-3/hump", "all", "paper/dry-features"}
    assert mine["paper/dry-features"]["paper"] == 0.316
    assert mine["paper/dry-features"]["value"] == mine["dry/hump"]["value"]
    assert mine["all"]["averaged"] == 3
    for key in ("value", "floor"):
        parts = [mine[name][key] for name in ("dry/hump", "snow-1/hump", "snow-3/hump")]
        assert mine["all"][key] == pytest.approx(sum(parts) / 3)
    # the dataset has no stop, and its means over coasting cars stand beside no figure of the paper
    assert all(row["paper"] is None for row in rows if row["metric"] in ("e_weather", "e_path"))
    missing = [row for row in rows if row["metric"] == "dover_overall" and row["paper"] is not None]
    assert [(row["value"], row["paper"], row["note"]) for row in missing] == [
        (None, 0.18, "not run: checkpoint missing")
    ]


def test_independent_traces_are_a_second_standard_beside_the_clips_telemetry(judged: Path) -> None:
    rows = json.loads((judged / "evaluation.json").read_text())["rows"]
    single = {(r["metric"], r["method"], r["condition"], r["window"]): r for r in rows if not r["averaged"]}

    def value(metric: str, condition: str, method: str = "telemetry", window: int = 0) -> float:
        return single[metric, method, condition, window]["value"]

    for method in (
        "telemetry",
        "truth",
    ):  # the trace's pitch is 1.25 times the picture's: 0.25 / 1.25 is wrong
        assert value("e_geometry_hump_reference", "dry/hump", method) == pytest.approx(0.2, abs=2e-3)
        assert value("pitch_relative_error_reference", "dry/hump", method) == pytest.approx(0.2, abs=2e-3)
        assert value("e_path_reference", "snow-3/flat", method) == pytest.approx(0, abs=1e-5)
    assert value("e_geometry_hump", "dry/hump", "truth") == pytest.approx(0, abs=1e-3)
    # the dry trace is the clip's own; that in snow loses 3 % of its way evenly, which bends its progress
    u = np.linspace(0, 1, 31)
    bent = np.sqrt(np.mean((u * (1 - 0.03 * u) / 0.97 - u) ** 2))
    assert value("e_weather_reference", "snow-3/flat") == pytest.approx(bent, rel=0.05)
    for method in ("photometric", "pnp", "essential"):
        both = [value(f"e_geometry_hump{suffix}", "dry/hump", method) for suffix in ("", "_reference")]
        assert both[0] != both[1]
    untold = [r for r in rows if r["metric"] == "case_reference" and r["averaged"] is None]
    assert {r["condition"] for r in untold} == {"snow-1/flat", "snow-1/hump"}
    assert all("the nearest, snow-3" in r["note"] and "surface_coefficient" in r["note"] for r in untold)
    paper = [
        r
        for r in rows
        if r["metric"] == "e_geometry_hump_reference" and r["condition"] == "paper/dry-features"
    ]
    assert paper and all(r["paper"] == 0.316 for r in paper)


def test_a_reference_for_no_clip_and_an_unknown_window_are_refused(judged: Path, tmp_path: Path) -> None:
    made, traces = str(judged.parent / "made"), judged.parent / "reference"
    with pytest.raises(InputError, match="event_window must be contact or paper; it is late"):
        evaluate_dataset(made, out=str(tmp_path / "a"), event_window="late")  # type: ignore[arg-type]
    assert not (tmp_path / "a").exists() and traces.is_dir()


def test_a_reference_that_cannot_be_used_is_refused_before_a_clip_is_judged(
    judged: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(evaluation, "judge_clip", None)
    made, traces = str(judged.parent / "made"), tmp_path / "other"
    shutil.copytree(judged.parent / "reference", traces)
    cases = json.loads((traces / "cases.json").read_text())
    (traces / "cases.json").write_text(json.dumps([case | {"surface_coefficient": 0.5} for case in cases]))
    with pytest.raises(InputError, match="no clip of the dataset has a reference case"):
        evaluate_dataset(made, out=str(tmp_path / "out"), reference=str(traces))
    with pytest.raises(InputError, match=r"nowhere/cases\.json: no such file"):
        evaluate_dataset(made, out=str(tmp_path / "out"), reference=str(tmp_path / "nowhere"))
    with pytest.raises(
        InputError, match="--metric speaks of the lengths in --trajectories, and there are none"
    ):
        evaluate_dataset(made, out=str(tmp_path / "out"), metric=True)
