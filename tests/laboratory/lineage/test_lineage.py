"""The lines on which a clip's numbers rest follow from what the dataset keeps: each is changed, the clip driven."""

import shutil
from pathlib import Path
from typing import Any

import pytest
import yaml

from catalogs.entries import find_entry
from flows.store.layout import Layout
from studies.lineage import trace as lineage
from studies.lineage.trace import format_text, trace_lineage
from tests.flows.reseal import reseal


@pytest.fixture(scope="module")
def kept(toy_dataset, tmp_path_factory) -> Layout:
    """The manifest and the kept entries of a dataset, and nothing else of it."""
    root = tmp_path_factory.mktemp("kept")
    shutil.copytree(toy_dataset.inputs, root / "inputs")
    shutil.copy(toy_dataset.manifest, root)
    return Layout(root)


@pytest.fixture(scope="module")
def traced(kept, tmp_path_factory) -> tuple[dict[str, Any], Path]:
    """Lineage of a braked clip on snow that covers the whole road, and the folder of its files."""
    out = tmp_path_factory.mktemp("lineage")
    return trace_lineage(str(kept.root), "snow-3/flat", out=str(out)), out


@pytest.fixture
def quick(monkeypatch):
    """No line is changed: for what does not depend on that."""
    monkeypatch.setattr(lineage, "move_lines", lambda *given: [])


def lines_of(result: dict[str, Any], column: str, *, threshold: bool | None = None) -> set[str]:
    (found,) = (row for row in result["columns"] if row["column"] == column)
    return {line["key"] for line in found["lines"] if threshold in (None, line["threshold"])}


def test_a_column_rests_on_what_its_equation_reads_and_on_nothing_else(traced):
    result, _ = traced
    falling = {"precipitation_mm_h", "snow_accumulation_h", "water_density", "fresh_snow_density"}
    assert result["follows"]
    assert lines_of(result, "snow_depth_mm", threshold=False) == falling
    # 30 mm lie on a road that 20 mm cover: there the friction is that of snow, and how deep it lies is a threshold
    assert lines_of(result, "surface_friction", threshold=False) == {"snow_friction"}
    assert lines_of(result, "surface_friction", threshold=True) == falling | {"full_cover_depth_mm"}
    assert lines_of(result, "brake_pressure_mpa") == {"peak_pressure_mpa", "ramp_s", "brake_onset_s"}
    assert lines_of(result, "static_pitch") == {"static_pitch"}
    assert lines_of(result, "pitch") > lines_of(result, "speed") > {"brake_gain", "families.snow.burckhardt"}
    assert {"snow.seed", "protocol.samples"} <= lines_of(result, "surface_friction_p05")
    assert "film_depth_mm" not in {row["column"] for row in result["columns"]}


def test_every_line_of_vehicle_and_pavement_is_told_once(traced, kept):
    """Counted in the files themselves: a number with a source rests somewhere, or moves nothing."""

    def count(value: Any) -> int:
        if not isinstance(value, dict):
            return 0
        return 1 if "source" in value else sum(map(count, value.values()))

    result, _ = traced
    told = [(row["file"], row["key"]) for row in (*result["lines"], *result["still"])]
    assert len(set(told)) == len(told)
    for name in ("vehicle.yaml", "surface.yaml"):
        assert sum(file == name for file, _ in told) == count(
            yaml.safe_load((kept.inputs / name).read_text())
        )
    other = {row["key"] for row in result["still"]}
    assert {"families.rain.burckhardt", "flooded_friction", "stop_speed"} <= other


def test_a_column_has_its_equation_and_the_works_with_their_doi(traced):
    result, _ = traced
    columns = {row["column"]: row for row in result["columns"]}
    assert columns["snow_depth_mm"]["equation"] == "3, S23" and columns["pitch"]["equation"] == "10, S15"
    assert columns["snow_depth_mm"]["works"] == ["Judson & Doesken 2000", "paper"]
    works = {row["work"]: row["doi"] for row in result["works"]}
    assert works["Judson & Doesken 2000"] == "10.1175/1520-0477(2000)081<1577:DOFFSI>2.3.CO;2"


def test_another_kind_of_weather_is_no_part_of_a_clip(kept, quick):
    files = {row["file"] for row in trace_lineage(str(kept.root), "dry/hump")["lines"]}
    assert "weather/sky.yaml" in files and "weather/snow.yaml" not in files


def test_lines_of_the_picture_are_told_by_file(traced):
    result, _ = traced
    by_file = {row["file"]: row["reaches"] for row in result["lines"] if not row["moves"] and row["reaches"]}
    assert by_file["camera.yaml"] == by_file["weather/snow.yaml"] == ["pictures", "pose check"]
    assert by_file["gates.yaml"] == ["pose check"]
    pitch = next(row for row in result["lines"] if row["key"] == "pitch_inertia")
    assert pitch["reaches"] == ["pictures", "pose check"]


def test_where_the_scene_is_not_at_hand_a_straight_road_reaches_as_far_as_the_drive(kept, monkeypatch):
    monkeypatch.setattr(lineage, "find_route", lambda scene: None)
    drives = []
    monkeypatch.setattr(lineage, "move_lines", lambda asked, kept, lines, drive: drives.append(drive) or [])
    result = trace_lineage(str(kept.root), "dry/hump")
    assert result["follows"] and not result["scene"]["at_hand"]
    ((last, station),) = [(d.numbers["T_world_rig"][-1], d.ride.columns["station"][-1]) for d in drives]
    assert last[0, 3] == pytest.approx(station, abs=0.05) and station > 10


def test_the_runs_that_a_vehicle_was_fitted_to_are_named(kept, tmp_path, quick):
    copy = Layout(tmp_path / "grown")
    shutil.copytree(kept.root, copy.root)
    shutil.copy(find_entry("vehicle", "multibody-grown"), copy.inputs / "vehicle.yaml")
    reseal(copy)
    result = trace_lineage(str(copy.root), "dry/flat")
    assert not result["follows"] and "NOT as recorded" in format_text(result)
    assert result["measured"]["procedure"] == "coupled-grown"
    assert f"hump-dry: {result['measured']['data_sha256']['hump-dry']}" in format_text(result)
