"""A run whose driver is killed goes on where it was; the 200 kills of `make study-crash` in short."""

from benchmarks.crashes.kills import DRIVER, kill_study


def test_killed_runs_resume_to_the_same_bytes_and_commit_no_half_clip(toy_dataset, tmp_path):
    grid = toy_dataset.root.parent / "grid.yaml"
    found = kill_study(grid, tmp_path, kills=1, seed=1, victims=[DRIVER])
    assert found["runs_finished"] >= 1 and found["equal"] == found["runs_finished"]
    assert found["half_clips"] == 0
