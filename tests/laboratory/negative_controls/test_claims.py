"""Faults that a metric must detect and faults that it cannot, on a motion that is known exactly."""

import numpy as np
import pytest

from studies.negative_controls.claims import (
    Claim,
    claims_differ,
    compute_separation,
    delay_claim,
    scale_claimed_pitch,
    score_claim,
)
from tasks.eval.body_agreement import rms
from tasks.eval.poses.motion import RecoveredMotion

TIMES = np.arange(81) * 0.1
PITCH = 0.03 * np.exp(-((TIMES - 3.0) ** 2) / 0.1)
CLAIM = Claim(pitch=PITCH, station=10 * TIMES)


def recovered_motion(pitch: np.ndarray, way: np.ndarray) -> RecoveredMotion:
    nothing = np.zeros(81)
    return RecoveredMotion(
        method="exact", T_rig0_rig=np.tile(np.eye(4), (81, 1, 1)), pitch=pitch - pitch[0], heave=nothing,
        lateral=nothing, progress=way, normalised_path=np.stack([way / way[-1], nothing, nothing], axis=1),
        pitch_std=nothing, progress_std=nothing, inliers=np.full(81, 100), failed=nothing > 0, failures=(),
    )  # fmt: skip


EXACT = recovered_motion(PITCH, 10 * TIMES)


def score_claims(claim: Claim) -> dict[str, float]:
    return score_claim(EXACT, claim, np.deg2rad(0.2), TIMES, 2.2)


def test_a_true_claim_scores_nothing() -> None:
    assert max(score_claims(CLAIM).values()) < 1e-12
    assert set(score_claims(CLAIM)) == {
        "pitch_rmse", "pitch_relative_error", "pitch_decorrelation", "normalised_progress_rmse", "progress_rmse",
        "e_geometry",
    }  # fmt: skip


def test_amplitude_is_invisible_to_correlation_and_to_progress() -> None:
    faulty = score_claims(scale_claimed_pitch(CLAIM, 0.8))
    assert faulty["e_geometry"] == pytest.approx(0.25, abs=0.001)  # an estimate of 1 against a claim of 0.8
    assert faulty["pitch_decorrelation"] < 1e-12 and faulty["normalised_progress_rmse"] < 1e-12


def test_a_sign_flip_and_a_late_frame_are_seen() -> None:
    assert score_claims(scale_claimed_pitch(CLAIM, -1.0))["pitch_relative_error"] == pytest.approx(2.0)
    late = delay_claim(CLAIM, 1)
    assert late.station[5] == CLAIM.station[4] and late.station[0] == late.station[1] == CLAIM.station[0]
    assert score_claims(late)["progress_rmse"] > 0.9


def test_relative_figures_are_left_out_without_a_response() -> None:
    assert "pitch_relative_error" not in score_claims(scale_claimed_pitch(CLAIM, 0.0))
    least = rms(PITCH - PITCH[0])
    assert "pitch_relative_error" in score_claim(EXACT, CLAIM, least, TIMES, 2.2)
    assert "pitch_relative_error" not in score_claim(EXACT, CLAIM, 1.001 * least, TIMES, 2.2)


def test_a_copy_that_says_the_same_is_no_fault() -> None:
    assert not claims_differ(scale_claimed_pitch(CLAIM, 0.999), CLAIM, np.deg2rad(0.05), 0.2)
    assert claims_differ(delay_claim(CLAIM, 1), CLAIM, np.deg2rad(0.05), 0.2)


def test_the_threshold_accuses_no_sound_clip() -> None:
    clear = compute_separation([0.1, 0.2, 0.15], [0.3, 0.4])
    assert (clear.threshold, clear.detection_rate, clear.auc, clear.verdict) == (0.2, 1.0, 1.0, "sees")
    mixed = compute_separation([0.1, 0.2], [0.1, 0.3])
    assert (mixed.detection_rate, mixed.auc, mixed.verdict) == (0.5, pytest.approx(0.625), "partly")
    assert (
        compute_separation([0.2, 0.2], [0.2]).auc == 0.5
        and compute_separation([0.2], [0.1]).verdict == "blind"
    )
    assert clear.false_alarms[-1] == clear.detections[-1] == 1.0
