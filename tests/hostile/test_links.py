"""Links, pipes and other things that are no files: nothing is read, written, cut or deleted through them."""

import os
import shutil
import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.hostile.stage import COMMANDS, LIGHT, WRITES, Stage, endure, refused, unrefused


def link(stage: Stage, name: str, target: str, *, missing: str | None = None) -> None:
    """Put a link in place of an entry; its content moves to the target, unless the victim has a file of that name."""
    place, aim = stage.dataset.root / name, stage.victim / target
    if place.exists() and not aim.exists():
        shutil.move(place, aim)
    elif place.is_dir():
        shutil.rmtree(place)
    else:
        place.unlink(missing_ok=True)
    if missing is not None:
        (aim / missing).unlink()
    place.parent.mkdir(parents=True, exist_ok=True)
    place.symlink_to(aim)


LINKS: dict[str, Callable[[Stage], object]] = {
    "staging folder, so that gc empties another folder": lambda s: link(s, ".staging", ""),
    "lock, so that it is cut to nothing": lambda s: link(s, ".staging/lock", "id_rsa"),
    "scratch folder in staging": lambda s: link(s, ".staging/scratch-abc", ""),
    "receipt in staging": lambda s: link(s, ".staging/0123456789abcdef.json", "id_rsa"),
    "half-written folder": lambda s: link(s, "frames.zarr.1.partial", ""),
    "folder of a family": lambda s: link(s, "telemetry/ticks/family=dry", "dry", missing="part-0000.parquet"),
    "frames, of which repair makes a file again": lambda s: link(s, "frames.zarr", "f", missing="zarr.json"),
    "shards of one array": lambda s: link(s, "frames.zarr/rgb/c", "c", missing="1/0/0/0/0"),
    "one shard": lambda s: link(s, "frames.zarr/rgb/c/1/0/0/0/0", "id_rsa"),
    "inputs, of which repair makes a file again": lambda s: link(s, "inputs", "i", missing="vehicle.yaml"),
    "one input": lambda s: link(s, "inputs/vehicle.yaml", "vehicle.yaml"),
    "previews, of which repair makes a file again": lambda s: link(
        s, "previews", "p", missing="contact_sheet.png"
    ),
    "plan": lambda s: link(s, "plan.json", "plan.json"),
    "manifest": lambda s: link(s, "manifest.json", "manifest.json"),
    "signature, so that signing overwrites its target": lambda s: link(s, "manifest.dsse.json", "id_rsa"),
    "link to the whole disk": lambda s: (s.dataset.root / "telemetry" / "root").symlink_to("/"),
    "link to itself": lambda s: (s.dataset.root / "previews" / "me").symlink_to("me"),
}


@pytest.mark.parametrize("attack", LINKS)
def test_a_link_in_a_dataset_in_place_of(stage, attack):
    LINKS[attack](stage)
    outcomes = endure(stage, *LIGHT, "open windows", "report", "generate")
    assert unrefused(outcomes, "verify", *WRITES) == []


@pytest.mark.parametrize("name", ["lock", "0123456789abcdef.json", "begun", "x.1.partial"])
def test_a_hard_link_to_somebody_s_file_in_staging_is_not_cut(stage, name):
    (stage.dataset.staging).mkdir()
    os.link(stage.victim / "id_rsa", stage.dataset.staging / name)
    endure(stage, "verify", "gc --dry-run", "repair", "sign", "generate", "gc")


@pytest.mark.parametrize(
    "name",
    ["plan.json", "manifest.json", "telemetry/clips.parquet", "frames.zarr/rgb/c/1/0/0/0/0", "inputs/vehicle.yaml",
     ".staging/lock", "manifest.dsse.json"],
)  # fmt: skip
def test_a_pipe_that_nobody_writes_to_keeps_no_command_waiting(stage, name):
    place: Path = stage.dataset.root / name
    place.parent.mkdir(exist_ok=True)
    place.unlink(missing_ok=True)
    os.mkfifo(place)
    try:
        assert refused(endure(stage, *LIGHT, "open windows", "sheets")["verify"])
    finally:
        if place.is_fifo():  # whoever still waits gets an end of file
            os.close(os.open(place, os.O_RDWR | os.O_NONBLOCK))


def test_devices_and_sockets_are_no_files_of_a_dataset(stage):
    (stage.dataset.inputs / "vehicle.yaml").unlink()
    (stage.dataset.inputs / "vehicle.yaml").symlink_to("/dev/zero")
    stage.dataset.plan.unlink()
    listener = socket.socket(socket.AF_UNIX)
    here = os.getcwd()
    try:
        os.chdir(stage.dataset.root)  # a socket's address must be short
        listener.bind("plan.json")
    finally:
        os.chdir(here)
        listener.close()
    assert refused(endure(stage, *COMMANDS)["verify"])


@pytest.mark.parametrize(
    "name", ["telemetry/clips.parquet", "manifest.json", "frames.zarr/rgb/c/1/0/0/0/0", ".staging/lock"],
)  # fmt: skip
def test_a_folder_in_place_of_a_file(stage, name):
    place = stage.dataset.root / name
    place.unlink(missing_ok=True)
    place.mkdir(parents=True)
    (place / "letter.txt").write_text("somebody's")
    endure(stage, *LIGHT, "open windows", "sheets")
    assert (place / "letter.txt").read_text() == "somebody's"


@pytest.mark.parametrize(
    "name", ["telemetry", "frames.zarr", "inputs", "previews", ".staging", "frames.zarr/rgb/c"]
)
def test_a_file_in_place_of_a_folder(stage, name):
    place = stage.dataset.root / name
    shutil.rmtree(place, ignore_errors=True)
    place.write_text("somebody's")
    outcomes = endure(stage, *LIGHT, "open windows", "sheets")
    assert unrefused(outcomes, "verify", "repair", "open windows", "sheets") == []
    assert place.read_text() == "somebody's"


def test_files_that_somebody_keeps_in_the_dataset_are_not_deleted(stage):
    own = [".staging/notes.txt", "telemetry/notes.partial", "my.1.partial.txt", ".repair-mine/x", "film.mp4"]
    for name in own:
        (stage.dataset.root / name).parent.mkdir(exist_ok=True)
        (stage.dataset.root / name).write_text("mine")
    endure(stage, "repair", "sign", "gc", "generate")
    assert [name for name in own if not (stage.dataset.root / name).is_file()] == []


@pytest.mark.parametrize("name", [".repair-mine", ".audit-mine", "scratch-mine", ".staging"])
@pytest.mark.parametrize("kind", ["folder", "link"])
def test_folders_beside_a_dataset_that_look_like_scratch_stay(stage, name, kind):
    beside = stage.dataset.root.parent / name
    if kind == "link":
        beside.symlink_to(stage.victim / "scratch-x")
    else:
        shutil.copytree(stage.victim / "scratch-x", beside)
    endure(stage, "gc --dry-run", "repair", "gc")
    assert (beside / ".staging" / "lock").read_text().startswith("precious")
