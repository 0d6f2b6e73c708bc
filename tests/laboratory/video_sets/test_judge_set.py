"""`musync lab judge-set`: editors whose motion is known must land where the protocol's equations say."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml

from studies.foreign_video.judge import read_claim
from studies.foreign_video.sources import read_camera
from studies.synthetic_street import (
    drive_clip,
    hump_drive,
    make_mount,
    rig_poses,
)
from studies.video_sets.files import SetClip, find_set
from studies.video_sets.judge_set import format_cell, judge_video_set
from studies.video_sets.motion import JudgedSet, look_at_clip
from studies.video_sets.motion_panels import list_set_panels
from studies.video_sets.protocol import load_protocol
from tasks.errors import InputError
from tests.laboratory.foreign_video.test_foreign import encode
from tests.laboratory.foreign_video.test_trajectories import tum_lines

Drive = tuple[np.ndarray, np.ndarray, np.ndarray]
STOPS = {"sunny": 7.0, "rain-50": 4.0, "snow-3": 2.0}
"""Deceleration of each weather [m/s2]."""
PROTOCOL = {
    "seeds": {"value": [1, 2], "unit": "1", "source": "test"},
    "frames": {"value": 81, "unit": "1", "source": "test"},
    "weather_interval": {"value": 0.1, "unit": "s", "source": "test"},
    "weather_duration": {"value": 8.0, "unit": "s", "source": "test"},
    "event_opening": {"value": 2.2, "unit": "s", "source": "test"},
    "retention_event": {"value": [16, 42], "unit": "1", "source": "test"},
    "smoothing_window": {"value": 5, "unit": "1", "source": "test"},
    "weather_control": "sunny",
    "weather_levels": {
        "rain-50": {"weather": "rain", "precipitation_mm_h": 50},
        "snow-3": {"weather": "snow", "precipitation_mm_h": 3},
    },
    "geometry_control": "flat",
    "geometry_features": ["hump"],
    "preservation_weathers": ["sunny"],
    "preservation_motion": "braking",
    "preservation_events": ["hump"],
    "prompts": {},
    "models": {},
    "unprinted": [],
    "printed": {"source": "test", "other": {"e_weather": [0.05, 0.01], "e_geometry_hump": [1.0]}},
}


def stop(weather: str) -> Drive:
    return hump_drive(81, 10.0, 60 / 3.6, STOPS[weather], hump_at=99.0)


def bump() -> Drive:
    return hump_drive(81, 16.0, hump_at=2.3)


def write_motion(path: Path, drive: Drive, rate: float, aside: float = 0.0) -> None:
    """A trajectory, as a pose estimator gives it, of a drive that also drifts aside in a sine over its way [m]."""
    station, heave, pitch = drive
    poses = rig_poses(station, heave, pitch)
    poses[:, 1, 3] += aside * np.sin(np.pi * (station - station[0]) / np.ptp(station))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(tum_lines(np.arange(len(station)) / rate, poses @ make_mount()))


def write_claim(path: Path, drive: Drive, rate: float) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    table = {"time": np.arange(81) / rate, "pitch": drive[2], "station": drive[0]}
    pq.write_table(pa.table(table), path)


def delay(drive: Drive, frames: int) -> Drive:
    """Each frame shows what `frames` earlier ones showed, as an editor that answers late does."""
    shown = np.maximum(np.arange(81) - frames, 0)
    return drive[0][shown], drive[1][shown], drive[2][shown]


def write_model(folder: Path, seed: int, motions: dict[str, Drive], aside: float = 0.0) -> None:
    for clip, drive in motions.items():
        rate = 16.0 if clip.startswith("geometry") else 10.0
        drift = 0.0 if clip.endswith("sunny") else aside
        write_motion(folder / f"seed-{seed}" / f"{clip}.true.txt", drive, rate, drift)


@pytest.fixture(scope="module")
def judged(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    root = tmp_path_factory.mktemp("set")
    folder = root / "set"
    (root / "tiny.yaml").write_text(yaml.safe_dump(PROTOCOL))
    folder.mkdir()
    (folder / "camera.yaml").write_text("width: 96\nheight: 64\nfocal_length: 80\n")
    for weather in STOPS:
        write_claim(folder / f"claims/weather/{weather}.parquet", stop(weather), 10.0)
    write_claim(folder / "claims/geometry/hump.parquet", bump(), 16.0)
    level = (bump()[0], 0 * bump()[1], 0 * bump()[2])
    kept = {"preservation/sunny-hump": hump_drive(81, 10.0, 12.0, 6.0, hump_at=2.0)}
    kept["preservation/sunny-braking"] = hump_drive(81, 10.0, 12.0, 6.0, hump_at=99.0)
    for clip, drive in kept.items():
        write_motion(folder / f"source/{clip}.true.txt", drive, 10.0)
    true = {f"weather/{name}": stop(name) for name in STOPS} | {"geometry/hump": bump()}
    graded = {f"weather/{name}": stop("sunny") for name in STOPS} | {"geometry/hump": level} | kept
    late = {name: delay(drive, 0 if name.endswith("sunny") else 4) for name, drive in true.items()}
    models = folder / "models"
    write_model(models / "synchronised", 1, true)
    write_model(models / "graded", 1, graded)
    write_model(models / "late", 1, late)
    write_model(models / "drifting", 1, true, aside=0.4)
    write_model(models / "drifting", 2, true, aside=0.2)
    judge_video_set(str(folder), protocol=str(root / "tiny.yaml"), out=str(root / "out"), window=0)
    return json.loads((root / "out/judge-set.json").read_text()) | {"root": root}


def cell(judged: dict[str, Any], model: str, metric: str, by: str = "measured") -> Any:
    (row,) = (row for row in judged["table"] if (row["model"], row["by"]) == (model, by))
    return None if row[metric] is None else row[metric]["mean"]


def progress(weather: str, frames: int = 0) -> np.ndarray:
    way = delay(stop(weather), frames)[0]
    return (way - way[0]) / np.ptp(way)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_an_editor_that_only_grades_colours_scores_what_the_dry_pose_scores(judged: dict[str, Any]) -> None:
    wanted = np.mean([rms(progress(name) - progress("sunny")) for name in ("rain-50", "snow-3")])
    assert wanted > 0.03
    assert cell(judged, "graded", "e_weather") == pytest.approx(wanted, rel=1e-3)
    assert cell(judged, "graded", "e_geometry_hump") == pytest.approx(1.0, abs=1e-6)
    assert cell(judged, "graded", "e_path") == pytest.approx(0.0, abs=1e-9)
    assert cell(judged, "graded", "motion_retention") == pytest.approx(1.0, abs=1e-6)


def test_motion_as_claimed_scores_nothing_and_the_floor_stands_beside_it(judged: dict[str, Any]) -> None:
    for metric in ("e_weather", "e_geometry_hump", "e_path"):
        assert cell(judged, "synchronised", metric) == pytest.approx(0.0, abs=1e-3)
        assert cell(judged, "synchronised", metric, "floor of a perfect pose") == 0.0
    assert cell(judged, "synchronised", "motion_retention") is None


def test_a_late_answer_shows_in_time_and_not_in_the_path(judged: dict[str, Any]) -> None:
    wanted = np.mean([rms(progress(name, 4) - progress(name)) for name in ("rain-50", "snow-3")])
    assert cell(judged, "late", "e_weather") == pytest.approx(wanted, rel=5e-3)
    assert cell(judged, "late", "e_geometry_hump") > 0.5
    # E_path runs over progress, not over time: Appendix A.6 takes braking durations out of it
    assert cell(judged, "late", "e_path") == pytest.approx(0.0, abs=1e-9)


def test_a_drift_aside_shows_in_the_path_and_is_averaged_over_seeds(judged: dict[str, Any]) -> None:
    u = np.linspace(0, 1, 101)
    by_seed = [
        np.mean([rms(aside / np.ptp(stop(name)[0]) * np.sin(np.pi * u)) for name in ("rain-50", "snow-3")])
        for aside in (0.4, 0.2)
    ]
    (row,) = (r for r in judged["table"] if (r["model"], r["by"]) == ("drifting", "measured"))
    assert row["e_path"]["mean"] == pytest.approx(np.mean(by_seed), rel=0.02)
    assert row["e_path"]["seed_std"] == pytest.approx(np.std(by_seed, ddof=1), rel=0.02)
    assert row["e_path"]["clips"] == 4 and row["e_weather"]["mean"] == pytest.approx(0.0, abs=1e-3)


def test_the_table_holds_what_is_printed_and_says_what_is_missing(judged: dict[str, Any]) -> None:
    assert cell(judged, "other", "e_weather", "printed") == 0.05
    text = (judged["root"] / "out/judge-set.md").read_text()
    assert "| other | printed |" in text and "0.0500 ± 0.0100" in text and "dover" not in text
    lacking = {row["model"]: row["clips"] for row in judged["missing"] if row["seed"] == "1"}
    assert lacking["synchronised"] == [
        "geometry/flat",
        "preservation/sunny-braking",
        "preservation/sunny-hump",
    ]
    notes = {
        row["note"] for row in judged["rows"] if row["metric"] == "temporal_iou" and row["value"] is None
    }
    assert not notes, "without videos there is no road edit to score"
    assert all(row["note"] for row in judged["rows"] if row["value"] is None)
    assert format_cell(None) == "-"


def test_a_short_video_and_a_missing_claim_are_said_where_they_matter(
    judged: dict[str, Any], tmp_path: Path
) -> None:
    folder = tmp_path / "set"
    write_claim(folder / "claims/weather/sunny.parquet", stop("sunny"), 10.0)
    (folder / "camera.yaml").write_text("width: 96\nheight: 64\nfocal_length: 80\n")
    write_motion(folder / "source/weather/sunny.true.txt", stop("sunny"), 10.0)
    short = tuple(column[:60] for column in stop("snow-3"))
    write_model(folder / "models/one", 1, {"weather/rain-50": stop("rain-50"), "weather/snow-3": short})
    write_claim(folder / "claims/weather/snow-3.parquet", stop("snow-3"), 10.0)
    protocol = str(judged["root"] / "tiny.yaml")
    rows = judge_video_set(str(folder), protocol=protocol, out=str(tmp_path / "out"))["rows"]
    notes = {(row["metric"], row["condition"]): row["note"] for row in rows}
    assert "claims of weather/rain-50" in notes["e_weather", "weather/rain-50"]
    assert "ends at 5.90 s; the protocol judges it to 8.00 s" in notes["e_weather", "weather/snow-3"]
    assert notes["e_path", "weather/rain-50"] == "against the source's control: the model made none"


def test_files_of_unknown_names_are_refused_all_at_once(tmp_path: Path) -> None:
    protocol = load_protocol("paper")
    for name in ("models/one/seed-1/weather/rain-7.mp4", "models/one/first/weather/rain-2.mp4", "targets/wall.mp4",
                 "claims/weather/hail.parquet"):  # fmt: skip
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    with pytest.raises(InputError) as caught:
        find_set(tmp_path, protocol)
    told = str(caught.value)
    for words in ("rain-7.mp4: no clip of the protocol", "first: a model's clips must lie in seed-N",
                  "wall.mp4: no road feature", "hail.parquet: no clip", "camera.yaml: no such file"):  # fmt: skip
        assert words in told


def test_the_papers_protocol_has_its_clips_prompts_and_printed_rows() -> None:
    protocol = load_protocol("paper")
    assert len(protocol.clips) == 9 + 3 + 9 and set(protocol.prompts) < set(protocol.clips)
    assert "50 millimeters per hour" in protocol.prompts["weather/rain-50"]
    assert protocol.printed_figures["vace"]["e_weather"] == (0.0867, 0.0050)
    assert protocol.printed_figures["carsim-pose"] == {
        "e_geometry_hump": (0.354,), "e_geometry_depression": (0.406,)
    }  # fmt: skip
    assert {"cosmos", "ltx-video", "vace"} == set(protocol.models)


def test_a_video_is_seen_by_the_chain_and_a_painted_road_by_the_edit_metrics(
    judged: dict[str, Any], tmp_path: Path
) -> None:
    clip = drive_clip(frames=8, frame_rate=16.0, hump_at=9.0, width=240, height=160, focal=200.0)
    folder = tmp_path / "set/models/painter/seed-1/geometry"
    folder.mkdir(parents=True)
    target = np.zeros((8, 160, 240, 3), np.uint8)
    target[:, 110:125, 90:150] = 255
    painted = np.where(target > 0, 255 - clip.frames // 4, clip.frames).astype(np.uint8)
    encode(folder / "flat.mp4", clip.frames, 16.0, "mp4v")
    encode(folder / "hump.mp4", painted, 16.0, "mp4v")
    (tmp_path / "set/targets").mkdir()
    encode(tmp_path / "set/targets/hump.mp4", target, 16.0, "mp4v")
    (tmp_path / "set/camera.yaml").write_text("width: 240\nheight: 160\nfocal_length: 200\n")
    protocol = str(judged["root"] / "tiny.yaml")
    result = judge_video_set(str(tmp_path / "set"), protocol=protocol, out=str(tmp_path / "out"))
    (row,) = (row for row in result["table"] if row["by"] == "measured")
    assert row["localised_edit_rate"]["mean"] == 1.0 and row["anchor_error"]["mean"] < 0.02
    assert row["method"] == "essential" and row["temporal_iou"]["mean"] > 0.3
    # colours do not move the car
    graded = cv2.convertScaleAbs(clip.frames.reshape(-1, 240, 3), alpha=0.7, beta=20).reshape(
        clip.frames.shape
    )
    encode(tmp_path / "graded.mp4", graded, 16.0, "MJPG")
    camera = read_camera(tmp_path / "set/camera.yaml")
    paths = folder / "flat.mp4", tmp_path / "graded.mp4"
    pitch = [
        look_at_clip(SetClip(model="m", seed="1", clip="geometry/flat", method="essential", path=path), camera,
                     {}, ()).motion.pitch
        for path in paths
    ]  # fmt: skip
    assert np.rad2deg(np.abs(pitch[0] - pitch[1])).max() < 0.05


def test_a_panel_has_the_claim_and_a_row_a_seed_of_each_model(judged: dict[str, Any]) -> None:
    protocol = load_protocol(str(judged["root"] / "tiny.yaml"))
    files = find_set(judged["root"] / "set", protocol)
    lighter = protocol.weather_levels["rain-50"].model_copy(update={"precipitation_mm_h": 10})
    protocol = protocol.model_copy(
        update={"weather_levels": {"rain-10": lighter} | protocol.weather_levels | {"rain-9": lighter}}
    )
    camera = read_camera(files.camera)
    looked = [look_at_clip(clip, camera, {}, ()) for clip in files.clips]
    motions = {(m.clip.model, m.clip.seed, m.clip.clip, m.clip.method): m for m in looked}
    claims = {name: read_claim(path) for name, path in files.claims.items()}
    panels = list_set_panels(
        JudgedSet(protocol=protocol, files=files, motions=motions, claims=claims, judges={}), None
    )
    rain, snow, hump = panels
    assert [panel.title for panel in panels] == ["weather/rain-50", "weather/snow-3", "geometry/hump"]
    meant = progress("snow-3") - progress("sunny")
    np.testing.assert_allclose(snow.meant, meant, atol=1e-9)
    np.testing.assert_allclose(snow.recovered["drifting, true"], [meant, meant], atol=1e-3)
    np.testing.assert_allclose(rain.recovered["graded, true"], np.zeros((1, 81)), atol=1e-9)
    assert np.abs(hump.recovered["graded, true"]).max() < 1e-6 < 0.5 < np.abs(hump.meant).max()
    assert hump.shaded == pytest.approx((2.2, 3.8))
