"""The real example in the repository: two stops of a BMW M8, with the figures that the document prints."""

import json
from pathlib import Path

import pytest

from flows.measured.importing import import_measurements
from manifests.provenance import SOURCE_ROOT
from studies.measured_drives.stop_study import stop_study

EXCERPT = SOURCE_ROOT / "catalogs" / "measured" / "bmw_m8"


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("m8") / "campaign"
    import_measurements(str(EXCERPT), map="bmw-m8", out=str(folder))
    return folder


def test_the_excerpt_is_small_and_carries_its_licence() -> None:
    assert "MIT License" in (EXCERPT / "LICENSE").read_text()
    assert "ROADVIEW" in (EXCERPT / "LICENSE").read_text()
    assert sum(file.stat().st_size for file in EXCERPT.iterdir()) < 2_000_000


def test_the_stops_are_those_of_the_published_recording(campaign: Path) -> None:
    # PROVENANCE of the recording: 18.9 m/s to rest in 20.7 m, the second stop from 18.0 m/s
    result = stop_study(str(campaign))
    train, held_out = result["measured"]
    assert train["start_speed_m_s"] == pytest.approx(18.0, abs=0.2)
    assert held_out["start_speed_m_s"] == pytest.approx(18.9, abs=0.1)
    assert held_out["stopping_distance_m"] == pytest.approx(20.0, abs=0.8)


def test_what_is_added_makes_the_other_stop_come_out_better(campaign: Path, tmp_path: Path) -> None:
    result = stop_study(str(campaign), out=str(tmp_path))
    assert result == json.loads((tmp_path / "stop_study.json").read_text())
    rungs = {row["rung"]: row for row in result["rungs"]}
    before, after = rungs["calibrated"]["held_out"], rungs["swing after the stop"]["held_out"]
    # to the digits that docs/evidence/measured-drives.md prints
    assert before["speed_rmse"] == pytest.approx(0.601, abs=6e-4)
    assert after["speed_rmse"] == pytest.approx(0.169, abs=6e-4)
    assert before["distance_error"] == pytest.approx(1.31, abs=6e-3)
    assert after["distance_error"] == pytest.approx(0.05, abs=6e-3)
    assert after["pitch_rmse"] < 0.6 * before["pitch_rmse"]
    still, swinging = (
        rungs[name]["after_stop"] for name in ("pad friction against speed", "swing after the stop")
    )
    assert still["predicted_peak"] == 0.0
    assert swinging["predicted_peak"] == pytest.approx(swinging["measured_peak"], rel=0.15)
    assert swinging["rmse"] < 0.6 * still["rmse"]


def test_what_the_model_still_lacks_is_in_the_findings(campaign: Path) -> None:
    findings = stop_study(str(campaign))["findings"]
    saturated = findings["saturation"]["held_out"]
    assert saturated["torque_largest"] > 1.4 * saturated["torque_at_peak"]
    assert saturated["deceleration_then"] < saturated["deceleration_at_peak"]
    assert findings["slip"]["measured"]["cycles_per_s"] > 2 > findings["slip"]["predicted"]["cycles_per_s"]
    assert findings["slip"]["measured"]["p95"] > 1.3 * findings["slip"]["predicted"]["p95"]
    assert findings["rebound_deg"]["back"] < -0.2
