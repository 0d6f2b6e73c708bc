"""`musync evaluate` end to end on a toy dataset: every figure is a number with its note, or says why not."""

import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from flows.judging.evaluation import NOT_RUN, evaluate_dataset
from flows.judging.physics import clip_columns, clip_facts
from flows.making.clip import catalogue_of
from flows.making.generate import generate_dataset
from tests.flows.judging.test_trajectories import tum_lines
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
    evaluate_dataset(
        str(folder / "made"), out=str(folder / "out"), trajectories=str(folder / "told"), metric=True
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


def test_every_metric_has_rows_and_a_row_without_a_value_says_why(judged: Path) -> None:
    rows = json.loads((judged / "evaluation.json").read_text())["rows"]
    names = {row["metric"] for row in rows}
    assert {"pitch_rmse", "e_weather", "e_geometry_hump", "e_path", "localised_edit_rate", "temporal_iou",
            "anchor_error", "severity_rank_correlation", "piqe", "temporal_error", "twin_ssim", "twin_flip",
            *NOT_RUN} <= names  # fmt: skip
    assert all(row["note"] for row in rows if row["value"] is None)
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
    assert html.count("<svg") == 2
    assert 'src="http' not in html and "<link" not in html and "<script" not in html
    assert "not run: checkpoint missing" in html
    assert all(f"<td>{name}</td>" in html for name in ("paper/dry-features", "snow-3/all"))


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
