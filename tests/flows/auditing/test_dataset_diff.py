"""Two toy datasets: the same, one with another car, one with another look."""

import json
from pathlib import Path

import pytest
import yaml

from catalogs.entries import find_entry
from catalogs.scenes import write_scene
from flows.auditing.dataset_diff import compare_datasets, format_text, pair_clips
from flows.making.generate import generate_dataset
from tests.toy_street import TOY_CAMERA, toy_street

GRID = """
name: toy
scene: {scene}
camera: {camera}
vehicle: {vehicle}
frames: {frames}
frame_rate_hz: 10
seed: {seed}
axes:
  weather:
    dry: {{weather: dry}}
    snow-3: {{weather: snow, precipitation_mm_h: 3, snow_accumulation_h: 1}}
  drive:
    brakes: {{initial_speed_km_h: 25, peak_pressure_mpa: 2.0, brake_onset_s: 0.2}}
    coasts: {{initial_speed_km_h: 25}}
"""


@pytest.fixture(scope="module")
def datasets(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("diff")
    write_scene(toy_street(), folder / "scene", {})
    (folder / "camera.yaml").write_text(TOY_CAMERA)
    car = yaml.safe_load(find_entry("vehicle", "paper-reference").read_text())
    (folder / "plain.yaml").write_text(yaml.safe_dump(car))
    car["brake_gain"]["value"] = 800
    (folder / "weak.yaml").write_text(yaml.safe_dump(car))
    made = {}
    for name, vehicle, seed, frames in (
        ("a", "plain", 1, 31),
        ("again", "plain", 1, 31),
        ("weak", "weak", 1, 31),
        ("seen", "plain", 1, 5),
        ("other seed", "plain", 2, 5),
        ("without pictures", "plain", 1, 5),
    ):
        (folder / f"{name}-grid.yaml").write_text(
            GRID.format(
                scene=folder / "scene",
                camera=folder / "camera.yaml",
                vehicle=folder / f"{vehicle}.yaml",
                seed=seed,
                frames=frames,
            )
        )
        generate_dataset(
            str(folder / f"{name}-grid.yaml"), str(folder / name), runner="threads", workers=1,
            pictures="see" in name,
        )  # fmt: skip
        made[name] = str(folder / name)
    return made


def test_the_same_grid_made_twice_is_the_same(datasets: dict[str, str], tmp_path: Path) -> None:
    result = compare_datasets(datasets["a"], datasets["again"], out=str(tmp_path))
    assert result["same"] and result["clips"] == [] and result["why"] == []
    assert result == json.loads((tmp_path / "diff.json").read_text())
    text = (tmp_path / "diff.txt").read_text()
    assert text.startswith("0 of 4 clips differ") and "musync verify holds the files" in text


def test_a_weaker_brake_moves_only_the_clips_that_brake_and_is_named(datasets: dict[str, str]) -> None:
    result = compare_datasets(datasets["a"], datasets["weak"])
    assert not result["same"]
    clips = {row["label"]: row for row in result["clips"]}
    assert "dry/brakes" in clips and "dry/coasts" not in clips
    row = clips["dry/brakes"]
    assert row["labels"]["stopping_distance_change_m"] > 0.3
    assert row["labels"]["speed_rms_m_s"] > 0.05 and row["labels"]["axle_load_largest_n"] > 50
    assert row["labels"]["tyre_peak_change"] == 0.0
    assert row["why"] == ["vehicle.yaml"] and row["first"]["tick"] > 200
    named = [(why["path"], why["a"], why["b"]) for why in result["why"] if why["input"] == "vehicle.yaml"]
    assert named == [("brake_gain.value", 1000, 800)]
    assert result["summary"]["largest"]["stopping_distance_change_m"]["label"] in clips


def test_swapping_the_datasets_turns_the_changes_round(datasets: dict[str, str]) -> None:
    there, back = (
        compare_datasets(datasets["a"], datasets["weak"]),
        compare_datasets(datasets["weak"], datasets["a"]),
    )
    for x, y in zip(there["clips"], back["clips"], strict=True):
        assert x["labels"]["speed_rms_m_s"] == y["labels"]["speed_rms_m_s"]
        change = x["labels"]["stopping_distance_change_m"]
        if change is not None:
            assert change == -y["labels"]["stopping_distance_change_m"]


@pytest.mark.parametrize(("a", "b"), [("seen", "without pictures"), ("without pictures", "seen")])
def test_pictures_that_one_dataset_lacks_are_a_difference_either_way(
    datasets: dict[str, str], a: str, b: str
) -> None:
    result = compare_datasets(datasets[a], datasets[b])
    assert not result["same"] and len(result["clips"]) == 4
    assert all({"rgb", "depth", "class"} <= set(row["changed"]) for row in result["clips"])
    assert all(row["why"] == ["pictures"] and row["picture"] is None for row in result["clips"])


def test_another_seed_changes_the_picture_and_no_label(datasets: dict[str, str]) -> None:
    result = compare_datasets(datasets["seen"], datasets["other seed"])
    assert result["clips"] and all("ticks" not in row["changed"] for row in result["clips"])
    snow = next(row for row in result["clips"] if row["label"].startswith("snow"))
    assert 0 < snow["picture"]["changed_pixels_share"] <= 1
    assert snow["why"] == ["seed"]
    assert not any(row["labels"]["stopping_distance_change_m"] for row in result["clips"])


def test_the_text_says_which_label_moved_how_far_and_why(datasets: dict[str, str]) -> None:
    text = format_text(compare_datasets(datasets["a"], datasets["weak"]))
    assert "vehicle.yaml brake_gain.value: 1000 -> 800" in text
    assert "can come from: vehicle.yaml" in text and "stopping_distance_change_m: +" in text


def test_clips_of_one_scenario_are_paired_by_seed_then_in_order_and_none_is_lost() -> None:
    def list_clips(*named: str) -> list[dict]:
        return [{"clip_id": name, "scenario": {"weather": name[0]}, "seed": name[1:]} for name in named]

    def pair(ours: list[str], theirs: list[str]) -> tuple:
        pairs, *only = pair_clips(list_clips(*ours), list_clips(*theirs))
        told = [f"{a['clip_id']}-{b['clip_id']}" for a, b in pairs]
        return told, *([clip["clip_id"] for clip in clips] for clips in only)

    assert pair(["d1", "d2", "r1"], ["d2", "d1", "r1"]) == (["d1-d1", "d2-d2", "r1-r1"], [], [])
    assert pair(["d1", "d2", "d3"], ["d3", "d4"]) == (["d1-d4", "d3-d3"], ["d2"], [])
    assert pair(["d1"], ["d2", "d3", "s1"]) == (["d1-d2"], [], ["d3", "s1"])


def test_a_dataset_with_more_seeds_is_another_one(datasets: dict[str, str], tmp_path: Path) -> None:
    grid = Path(datasets["a"]).with_name("a-grid.yaml").read_text() + "visual_seeds: 2\n"
    (tmp_path / "grid.yaml").write_text(grid)
    generate_dataset(
        str(tmp_path / "grid.yaml"), str(tmp_path / "two"), runner="threads", workers=1, pictures=False
    )
    result = compare_datasets(datasets["a"], str(tmp_path / "two"))
    assert not result["same"] and result["summary"]["compared"] == 4
    assert len(result["only_in_b"]) == 4 and all(label.endswith("/seed-2") for label in result["only_in_b"])
    assert compare_datasets(str(tmp_path / "two"), str(tmp_path / "two"))["summary"]["compared"] == 8
