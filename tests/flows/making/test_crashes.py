"""A run whose driver is killed goes on where it was; one of the 200 kills of `make study-crash`."""

import time

from flows.making.generate import generate_dataset
from flows.store.layout import Layout
from studies.crashes.commands import kill_commands
from studies.crashes.kills import files_of, half_clips
from studies.crashes.processes import start_run


def test_a_killed_run_resumes_to_the_same_bytes_and_commits_no_half_clip(toy_dataset, tmp_path):
    grid, layout = toy_dataset.root.parent / "grid.yaml", Layout(tmp_path / "data")
    run = start_run(grid, layout.root, None, "--workers", "1")
    while run.poll() is None and not list(layout.staging.glob("*.json")):
        time.sleep(0.01)
    run.kill()
    run.wait()
    halves, committed = half_clips(layout)
    assert halves == 0 and committed >= 1 and not layout.manifest.exists()
    generate_dataset(str(grid), str(layout.root), runner="threads")
    assert files_of(layout.root) == files_of(toy_dataset.root)


def test_a_command_that_is_killed_before_any_change_of_the_disk_ends_the_second_time_with_nothing_left(
    tmp_path,
):
    found = kill_commands(tmp_path, ("sign", "export --to croissant"))
    assert [row["first"] for row in found.values()] == [None, None]
    assert all(row["equal"] == row["kills"] > 9 for row in found.values())
