"""`judge-set` on videos: editors that move no car land where Appendix A.5 puts a car on a dry road."""

from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml

from studies.synthetic_street import camera_matrix, hump_drive, render_clip
from studies.video_sets.editors import add_noise, warp_road, write_video
from studies.video_sets.judge_set import judge_video_set
from tests.laboratory.video_sets.test_judge_set import PROTOCOL, STOPS, cell, rms

BRIEF = PROTOCOL | {
    "frames": {"value": 31, "unit": "1", "source": "test"},
    "weather_duration": {"value": 3.0, "unit": "s", "source": "test"},
    "event_opening": {"value": 0.6, "unit": "s", "source": "test"},
    "weather_levels": {"rain-50": {"weather": "rain", "precipitation_mm_h": 50}},
}
EDITS = {
    "warped-road": (lambda frames: add_noise(warp_road(frames), 1), "mp4v"),
    "faster": (lambda frames: frames[np.minimum(np.arange(31) * 2, 30)], "FFV1"),
}


@pytest.fixture(scope="module")
def edited(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """A judged set whose editors were given the dry stop and the flat road, and moved no car, but for the last."""
    root = tmp_path_factory.mktemp("edited")
    (root / "brief.yaml").write_text(yaml.safe_dump(BRIEF))
    folder = root / "set"
    drives = {
        f"weather/{name}": hump_drive(31, 10.0, 12.0, STOPS[name], hump_at=99.0)
        for name in ("sunny", "rain-50")
    }
    drives["geometry/hump"] = hump_drive(31, 10.0, 6.0, hump_at=0.7)
    for name, (station, _, pitch) in drives.items():
        place = folder / f"claims/{name}.parquet"
        place.parent.mkdir(parents=True, exist_ok=True)
        pq.write_table(pa.table({"time": np.arange(31) / 10, "pitch": pitch, "station": station}), place)
    (folder / "camera.yaml").write_text("width: 240\nheight: 160\nfocal_length: 200\n")
    flat = (drives["geometry/hump"][0], np.zeros(31), np.zeros(31))
    dry, plain = (
        render_clip(*drive, K=camera_matrix(240, 160, 200.0), width=240, height=160).frames
        for drive in (drives["weather/sunny"], flat)
    )
    for model, (edit, codec) in EDITS.items():
        place = folder / f"models/{model}/seed-1"
        for name, frames in (
            ("weather/sunny", dry),
            ("weather/rain-50", edit(dry)),
            ("geometry/hump", edit(plain)),
        ):
            write_video(place / f"{name}.{'avi' if codec == 'FFV1' else 'mp4'}", frames, 10.0, codec)
    result = judge_video_set(str(folder), protocol=str(root / "brief.yaml"), out=str(root / "out"), window=0)
    ways = [drives[f"weather/{name}"][0] for name in ("rain-50", "sunny")]
    rain, sunny = ((way - way[0]) / np.ptp(way) for way in ways)
    return result | {"unmoved": rms(rain - sunny), "out": root / "out"}


def test_noise_a_swimming_road_and_another_codec_move_no_car(edited: dict[str, Any]) -> None:
    """Appendix A.5 for a car that moves as in the dry: the whole change that was meant, and no event in the pitch."""
    assert edited["unmoved"] > 0.05
    assert cell(edited, "warped-road", "e_weather") == pytest.approx(edited["unmoved"], rel=0.05)
    assert cell(edited, "warped-road", "e_geometry_hump") == pytest.approx(1.0, abs=0.1)
    assert cell(edited, "warped-road", "e_path") < 0.01


def test_a_car_that_an_editor_makes_faster_scores_otherwise(edited: dict[str, Any]) -> None:
    assert cell(edited, "faster", "e_weather") > 1.3 * edited["unmoved"]


def test_the_figure_of_motion_has_a_curve_a_model(edited: dict[str, Any]) -> None:
    drawn = (edited["out"] / "motion.svg").read_text()
    assert all(f"{model}, essential" in drawn for model in EDITS)
    assert "weather/rain-50" in drawn and "geometry/hump" in drawn
    assert "](motion.svg)" in (edited["out"] / "judge-set.md").read_text()
