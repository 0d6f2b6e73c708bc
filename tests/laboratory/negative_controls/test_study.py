"""Negative controls on clips whose pixels are replaced by their exact motion: what each control changes."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from flows.cli import app
from flows.making.catalogue import catalogue_of
from flows.making.generate import generate_dataset
from flows.making.plan import read_plan
from flows.reading.previews import make_films
from studies.evaluation.evaluation import evaluate_dataset
from studies.evaluation.judged_clip import METHODS, JudgedClip
from studies.negative_controls import study as judging_controls
from studies.negative_controls.claims import Claim
from studies.negative_controls.study import (
    BLIND_BY_DESIGN,
    CONTROLS,
    UNREAD,
    list_unread_rows,
    list_untried,
    make_false_claims,
    run_controls,
    score_controls,
    summarise_controls,
)
from studies.paper.sheets import draw_sheets
from studies.physics_judge.audit_physics import clip_columns, clip_facts
from tasks.errors import InputError
from tasks.eval.poses.motion import RecoveredMotion
from tests.toy_street import write_toy_grid

GRID = """
name: controls
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 41
frame_rate_hz: 10
axes:
  weather:
    dry: {{weather: dry}}
    rain-50: {{weather: rain, precipitation_mm_h: 50}}
    snow-3: {{weather: snow, precipitation_mm_h: 3, snow_accumulation_h: 1}}
  road:
    stop: {{initial_speed_km_h: 30, peak_pressure_mpa: 2.3, brake_onset_s: 0.3}}
"""


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("controls")
    generate_dataset(
        write_toy_grid(folder, GRID), str(folder / "made"), runner="threads", workers=1, pictures=False
    )
    return folder / "made"


def exactly(frames: dict[str, np.ndarray], error_deg: float) -> RecoveredMotion:
    way = frames["station"] - frames["station"][0]
    pitch = frames["pitch"] - frames["pitch"][0]
    nothing = np.zeros(len(way))
    poses = frames["T_world_rig"].reshape(-1, 4, 4)
    return RecoveredMotion(
        method="exact", T_rig0_rig=np.linalg.inv(poses[0]) @ poses, heave=nothing, lateral=nothing,
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


@pytest.fixture(scope="module")
def false(dataset: Path, clips: list[JudgedClip]) -> list[dict[str, Claim]]:
    return make_false_claims(clips, read_plan(dataset), catalogue_of(dataset))


def test_a_good_pose_check_sees_all_and_the_blind_are_named(
    clips: list[JudgedClip], false: list[dict[str, Claim]]
) -> None:
    rows = list(score_controls(clips, false))
    seen = {row["control"] for row in rows if row["verdict"] == "sees"}
    assert seen == set(CONTROLS)
    blind = {(row["control"], row["metric"]) for row in rows if row["verdict"] == "blind"}
    assert ("sign-flip", "normalised_progress_rmse") in blind and ("amplitude-0.8", "progress_rmse") in blind


def test_a_clip_whose_track_was_lost_is_not_scored(
    clips: list[JudgedClip], false: list[dict[str, Claim]]
) -> None:
    lost = replace(clips[0].motions["pnp"], failed=np.ones(41, bool))
    broken = [replace(clips[0], motions={**clips[0].motions, "pnp": lost}), *clips[1:]]
    rows = list(score_controls(broken, false))
    paired = ("e_weather", "e_path")
    alone = [row for row in rows if row["metric"] not in paired]
    assert {row["sound"] for row in alone if row["method"] == "pnp"} == {2}
    assert {row["sound"] for row in alone if row["method"] == "essential"} == {3}
    # the first clip is the dry sibling of the other two
    assert {row["method"] for row in rows if row["metric"] in paired} == {"photometric", "essential"}


def test_the_change_against_the_dry_sibling_is_held_against_the_claim(
    clips: list[JudgedClip], false: list[dict[str, Claim]]
) -> None:
    rows = list(score_controls(clips, false))
    weather = {row["control"]: row for row in rows if row["metric"] == "e_weather"}
    assert weather["appearance-only"]["verdict"] == "sees" and weather["appearance-only"]["sound"] == 2
    assert weather["sign-flip"]["verdict"] == "blind" and weather["sign-flip"]["threshold"] < 0.01
    path = [row for row in rows if row["metric"] == "e_path"]
    assert path and all(row["verdict"] == "blind" and row["reason"] == BLIND_BY_DESIGN for row in path)


def test_metrics_that_no_claim_enters_are_blind_to_every_control(
    clips: list[JudgedClip], false: list[dict[str, Claim]]
) -> None:
    rows = list(list_unread_rows())
    assert {(row["control"], row["metric"]) for row in rows} == {(c, m) for c in CONTROLS for m in UNREAD}
    assert {"localised_edit_rate", "severity_rank_correlation", "piqe"} <= set(UNREAD)
    assert all(row["verdict"] == "blind" and row["reason"] == BLIND_BY_DESIGN for row in rows)
    told = summarise_controls(list(score_controls(clips, false)), list_untried(clips, false))
    assert told["all_detected"] and told["undetected"] == []
    assert "piqe by no reference: every control, it never reads the claim" in told["blind"]


def test_a_control_that_could_not_be_tried_is_not_detected(
    clips: list[JudgedClip], false: list[dict[str, Claim]]
) -> None:
    without = [{name: claim for name, claim in f.items() if name != "fixed-mu"} for f in false]
    told = summarise_controls(list(score_controls(clips, without)), list_untried(clips, without))
    assert not told["all_detected"] and len(told["undetected"]) == 1
    assert told["undetected"][0].startswith("fixed-mu: not tried: in none of 3 clips does it change")
    by_name = {row["control"]: row for row in told["controls"]}
    assert not by_name["fixed-mu"]["tried"] and by_name["sign-flip"]["tried"]


def test_the_command_fails_and_names_what_could_not_be_tried(
    dataset: Path, clips: list[JudgedClip], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    made = {clip.facts["clip_id"]: clip for clip in clips}
    monkeypatch.setattr(judging_controls, "judge_clip", lambda view, facts: made[facts["clip_id"]])
    monkeypatch.setattr(judging_controls, "run_as_stage", lambda work: work)
    monkeypatch.setattr(judging_controls, "require_frames", lambda manifest, place, stored: None)
    arguments = ["lab", "controls", str(dataset), "--out", str(tmp_path / "out")]
    assert CliRunner().invoke(app, arguments).exit_code == 0
    monkeypatch.setattr(judging_controls, "LEAST_PITCH", 9.0)
    monkeypatch.setattr(judging_controls, "LEAST_WAY", 900.0)
    monkeypatch.setattr(judging_controls, "LEAST_MOVE", 900.0)
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 1 and "sign-flip: not tried" in result.output
    told = json.loads((tmp_path / "out" / "controls.json").read_text())
    assert not told["all_detected"] and {row["metric"] for row in told["rows"]} == set(UNREAD)


def test_what_needs_pictures_says_that_the_dataset_was_made_without_and_advises_no_repair(
    dataset: Path, tmp_path: Path
) -> None:
    place, out = str(dataset), str(tmp_path)
    for run in (
        lambda: run_controls(place),
        lambda: evaluate_dataset(place, out=out),
        lambda: draw_sheets(place, out),
        lambda: make_films(place, out),
    ):
        with pytest.raises(InputError, match=r"made: the dataset was made without frames \(--no-frames\)"):
            run()
    assert not any(tmp_path.iterdir())
