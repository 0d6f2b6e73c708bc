"""A run killed with its workers goes on where it was; the 50 kills of `make study-crash` in short."""

from benchmarks.crashes import crash_study


def test_killed_runs_resume_to_the_same_bytes_and_commit_no_half_clip(toy_dataset, tmp_path):
    found = crash_study(toy_dataset.root.parent / "grid.yaml", tmp_path, kills=1, seed=1)
    assert found["runs_finished"] >= 1 and found["equal"] == found["runs_finished"]
    assert found["half_clips"] == 0
