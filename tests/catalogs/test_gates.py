"""Limits of generated clips and of any video come from files that give value, unit and source."""

from pathlib import Path

import pytest
import yaml

from catalogs.entries import find_entry, load
from tasks.errors import InputError


def test_any_video_is_judged_by_what_needs_no_depth() -> None:
    limits = load("foreign gate file")
    assert (limits.pitch_relative_error, limits.pitch_correlation, limits.response_deg) == (0.20, 0.98, 0.20)
    assert (limits.normalised_progress_rmse, limits.failed_share) == (0.02, 0.0)
    assert limits.pitch_rmse_deg == float("inf") and limits.progress_rmse_m is None


def test_without_depth_no_limit_is_tighter_than_with_it() -> None:
    with_depth, without = load("gate file"), load("foreign gate file")
    assert without.pitch_relative_error >= with_depth.pitch_relative_error
    assert without.pitch_correlation <= with_depth.pitch_correlation
    assert without.response_deg >= with_depth.response_deg


@pytest.mark.parametrize("kind", ["gate file", "foreign gate file"])
def test_every_problem_of_a_gate_file_is_told_at_once(tmp_path: Path, kind: str) -> None:
    content = yaml.safe_load(find_entry(kind).read_text())
    content["pitch_correlation"]["value"] = 2.0
    content["response_deg"]["unit"] = "rad"
    del content["failed_share"]
    path = tmp_path / "gates.yaml"
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(InputError) as caught:
        load(kind, path)
    assert len(caught.value.problems) == 3
