"""Negative controls on clips whose pixels are replaced by their exact motion: what each control changes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from catalogs.scenes import write_scene
from flows.drawing import as_svg
from flows.judging.controls import CONTROLS, controls, score_controls
from flows.judging.controls_figure import roc_figure
from flows.judging.judged_clip import METHODS, JudgedClip
from flows.judging.physics import clip_columns, clip_facts
from flows.making.clip import catalogue_of
from flows.making.generate import generate
from flows.making.plan import read_plan
from tasks.errors import InputError
from tasks.eval.motion import RecoveredMotion
from tests.toy_street import TOY_CAMERA, toy_street

GRID = """
name: controls
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 41
frame_rate_hz: 10
axes:
  weather:
    rain-50: {{weather: rain, precipitation_mm_h: 50}}
    snow-3: {{weather: snow, precipitation_mm_h: 3, snow_accumulation_h: 1}}
  road:
    stop: {{initial_speed_km_h: 30, peak_pressure_mpa: 2.3, brake_onset_s: 0.3}}
"""


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("controls")
    write_scene(toy_street(), folder / "scene", {})
    (folder / "camera.yaml").write_text(TOY_CAMERA)
    (folder / "grid.yaml").write_text(GRID.format(folder=folder))
    generate(str(folder / "grid.yaml"), str(folder / "made"), runner="threads", workers=1, backend="cpu")
    return folder / "made"


def exactly(frames: dict[str, np.ndarray], error_deg: float) -> RecoveredMotion:
    way = frames["station"] - frames["station"][0]
    pitch = frames["pitch"] - frames["pitch"][0]
    nothing = np.zeros(len(way))
    return RecoveredMotion(
        method="exact", T_rig0_rig=np.tile(np.eye(4), (len(way), 1, 1)), heave=nothing, lateral=nothing,
        pitch=pitch + np.deg2rad(error_deg) * np.sin(np.arange(len(way))), progress=way,
        normalised_path=np.stack([way / way[-1], nothing, nothing], axis=1), pitch_std=nothing,
        progress_std=nothing, inliers=np.full(len(way), 100), failed=nothing > 0, failures=(),
    )  # fmt: skip


@pytest.fixture(scope="module")
def clips(dataset: Path) -> list[JudgedClip]:
    made = []
    for facts in clip_facts(dataset):
        frames = clip_columns(dataset, "frames", facts)
        motions = {method: exactly(frames, 0.01) for method in METHODS}
        made.append(
            JudgedClip(
                facts=facts,
                frames=frames,
                motions=motions,
                statistics={},
                thumbnails=np.zeros((3, 1, 1, 3), np.uint8),
                quality={},
            )
        )
    return made


def test_a_good_pose_check_sees_all_seven_and_the_blind_are_named(
    dataset: Path, clips: list[JudgedClip]
) -> None:
    rows = list(score_controls(clips, read_plan(dataset), catalogue_of(dataset)))
    seen = {row["control"] for row in rows if row["verdict"] == "sees"}
    assert seen == set(CONTROLS)
    blind = {(row["control"], row["metric"]) for row in rows if row["verdict"] == "blind"}
    assert ("sign-flip", "normalised_progress_rmse") in blind and ("amplitude-0.8", "progress_rmse") in blind


def test_each_fault_has_a_panel_with_the_curves_of_its_metrics(
    dataset: Path, clips: list[JudgedClip]
) -> None:
    rows = list(score_controls(clips, read_plan(dataset), catalogue_of(dataset)))
    drawing = as_svg(roc_figure(rows, CONTROLS))
    tried = {row["control"] for row in rows}
    assert all(name in drawing for name in tried)
    assert as_svg(roc_figure(rows, CONTROLS)) == drawing


def test_a_clip_whose_track_was_lost_is_not_scored(dataset: Path, clips: list[JudgedClip]) -> None:
    lost = replace(clips[0].motions["pnp"], failed=np.ones(41, bool))
    broken = [replace(clips[0], motions={**clips[0].motions, "pnp": lost}), *clips[1:]]
    rows = list(score_controls(broken, read_plan(dataset), catalogue_of(dataset)))
    assert {row["sound"] for row in rows if row["method"] == "pnp"} == {1}
    assert {row["sound"] for row in rows if row["method"] == "essential"} == {2}


def test_a_folder_that_is_no_dataset_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        controls(str(tmp_path))
