"""A run that stops anywhere goes on with the same command, before its plan too; what is another's is left alone."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

import flows.making.generate
from flows.auditing.repair import repair_dataset
from flows.auditing.verify import collect_garbage
from flows.making.generate import generate_dataset
from flows.making.locations import note_location, noted_location
from flows.making.plan import make_plan
from flows.store.layout import PARTIAL, Layout
from flows.store.lock import sole_writer
from tasks.errors import InputError

HALF_A_PLAN = f"plan.json.7-7{PARTIAL}"


@pytest.fixture(scope="module")
def grid(toy_dataset) -> str:
    return str(toy_dataset.root.parent / "grid.yaml")


def make(grid: str, folder: Path) -> Layout:
    return generate_dataset(grid, str(folder), runner="threads", workers=1, pictures=False).layout


def files_of(folder: Path) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.fixture(scope="module")
def whole(grid, tmp_path_factory) -> dict[str, bytes]:
    return files_of(make(grid, tmp_path_factory.mktemp("whole") / "data").root)


@pytest.mark.parametrize("writes", [0, 1, 2, 8, 15])
def test_a_disk_that_is_full_before_there_is_a_plan_can_be_freed_and_the_run_goes_on(
    grid, whole, tmp_path, monkeypatch, writes
):
    folder, left = tmp_path / "data", [writes]
    real = os.fsync

    def flush(descriptor: int) -> None:
        if str(folder) in os.readlink(f"/proc/self/fd/{descriptor}"):
            if left[0] == 0:
                raise OSError(28, "No space left on device")
            left[0] -= 1
        real(descriptor)

    monkeypatch.setattr(os, "fsync", flush)
    with pytest.raises(OSError, match="No space"):
        make(grid, folder)
    monkeypatch.undo()
    assert folder.is_dir() and not (folder / "plan.json").exists()
    make(grid, folder)
    assert files_of(folder) == whole


def test_what_a_run_left_that_stopped_after_its_manifest_goes_with_the_next_run_unless_one_is_at_work(
    grid, whole, tmp_path, monkeypatch
):
    def refuse(*args: object, **kwargs: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("flows.making.seal.send_files", refuse)
    with pytest.raises(OSError, match="No space"):
        make(grid, tmp_path / "data")
    monkeypatch.undo()
    stopped = files_of(tmp_path / "data")
    assert stopped.keys() > whole.keys()
    with sole_writer(Layout(tmp_path / "data")):
        make(grid, tmp_path / "data")
        assert files_of(tmp_path / "data") == stopped
    make(grid, tmp_path / "data")
    assert files_of(tmp_path / "data") == whole
    (tmp_path / "data" / ".staging").mkdir()
    (tmp_path / "data" / ".staging" / "lock").touch()
    make(grid, tmp_path / "data")
    assert files_of(tmp_path / "data") == whole


def test_a_run_that_was_begun_can_be_begun_anew_with_another_grid(grid, tmp_path, monkeypatch):
    """Before there is a plan nothing binds the folder to a grid."""
    other = tmp_path / "other.yaml"
    other.write_text(Path(grid).read_text().replace("frames: 11", "frames: 5"))

    def interrupt_run(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(flows.making.generate, "create_frame_arrays", interrupt_run)
    with pytest.raises(KeyboardInterrupt):
        make(grid, tmp_path / "data")
    monkeypatch.undo()
    assert make(str(other), tmp_path / "data").manifest.is_file()


def test_a_run_that_is_killed_while_it_writes_its_plan_goes_on(grid, whole, tmp_path, monkeypatch):
    def write_half(path: Path, pieces: object) -> None:
        path.with_name(HALF_A_PLAN).write_bytes(b"{")
        raise KeyboardInterrupt

    monkeypatch.setattr(flows.making.generate, "write_pieces", write_half)
    with pytest.raises(KeyboardInterrupt):
        make(grid, tmp_path / "data")
    monkeypatch.undo()
    assert {HALF_A_PLAN, "inputs/grid.json"} < files_of(tmp_path / "data").keys()
    make(grid, tmp_path / "data")
    assert files_of(tmp_path / "data") == whole


def stop_before_the_end(grid: str, folder: Path, monkeypatch) -> Layout:
    def interrupt_run(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(flows.making.generate, "seal_dataset", interrupt_run)
    with pytest.raises(KeyboardInterrupt):
        make(grid, folder)
    monkeypatch.undo()
    return Layout(folder)


def test_a_run_goes_on_with_the_inputs_it_was_planned_with_and_no_others(grid, whole, tmp_path, monkeypatch):
    """Clips of two vehicles in one dataset were sealed as one, and verified."""
    layout = stop_before_the_end(grid, tmp_path / "data", monkeypatch)
    next(layout.staging.glob("*.json")).unlink()
    vehicle = layout.inputs / "vehicle.yaml"
    vehicle.write_text(vehicle.read_text().replace("value: 1200", "value: 2200"))
    with pytest.raises(
        InputError, match=r"inputs/vehicle\.yaml: must be the file that the run was planned with"
    ):
        make(grid, layout.root)
    vehicle.unlink()
    make(grid, layout.root)
    assert files_of(layout.root) == whole


def test_inputs_that_change_while_clips_are_made_are_not_sealed(grid, tmp_path, monkeypatch):
    real = flows.making.generate.seal_dataset

    def change_and_seal(layout: Layout, *rest: object) -> object:
        (layout.inputs / "surface.yaml").write_text("{}")
        return real(layout, *rest)

    monkeypatch.setattr(flows.making.generate, "seal_dataset", change_and_seal)
    with pytest.raises(InputError, match=r"inputs/surface\.yaml: must be as recorded; it is changed"):
        make(grid, tmp_path / "data")
    assert not (tmp_path / "data" / "manifest.json").exists()


def test_a_clip_whose_rows_were_damaged_is_made_again(grid, whole, tmp_path, monkeypatch):
    layout = stop_before_the_end(grid, tmp_path / "data", monkeypatch)
    rows = next(layout.staging.glob("*.ticks.parquet"))
    content = bytearray(rows.read_bytes())
    content[len(content) // 4] ^= 1
    rows.write_bytes(content)
    make(grid, layout.root)
    assert files_of(layout.root) == whole


@pytest.mark.parametrize("name", ["inputs", "frames.zarr", "notes.txt", HALF_A_PLAN])
def test_a_folder_with_a_name_of_ours_but_without_our_mark_is_left_alone(grid, tmp_path, name):
    (tmp_path / "data" / name).mkdir(parents=True)
    (tmp_path / "data" / name / "precious.txt").write_text("mine")
    with pytest.raises(InputError, match="it holds other files"):
        make(grid, tmp_path / "data")
    assert files_of(tmp_path / "data") == {f"{name}/precious.txt": b"mine"}


def test_what_a_run_began_without_a_plan_is_no_dataset_to_collect_in(tmp_path):
    (tmp_path / "data" / ".staging").mkdir(parents=True)
    (tmp_path / "data" / ".staging" / "begun").touch()
    with pytest.raises(InputError, match="goes on with the same musync generate"):
        collect_garbage(str(tmp_path / "data"))


@pytest.mark.parametrize("command", [collect_garbage, repair_dataset])
def test_a_folder_that_is_no_dataset_is_not_touched_nor_made(tmp_path, command):
    (tmp_path / "mine").mkdir()
    for name in ("nowhere", "mine"):
        with pytest.raises(InputError):
            command(str(tmp_path / name))
    assert list(tmp_path.rglob("*")) == [tmp_path / "mine"]


def test_a_lock_that_is_a_link_or_another_name_of_a_file_is_refused_and_the_file_keeps_its_bytes(tmp_path):
    victim = tmp_path / "id_rsa"
    victim.write_text("secret")
    for kind in ("symlink_to", "hardlink_to"):
        layout = Layout(tmp_path / kind)
        layout.staging.mkdir(parents=True)
        getattr(layout.staging / "lock", kind)(victim)
        with pytest.raises(InputError, match="remove it"), sole_writer(layout):
            pass
        assert victim.read_text() == "secret"


def test_no_file_of_a_dataset_says_where_somebodys_files_lie(toy_dataset):
    """The grid names its scene and its camera by absolute paths."""
    folder = str(toy_dataset.root.parent).encode()
    assert folder in (toy_dataset.root.parent / "grid.yaml").read_bytes()
    assert [name for name, content in files_of(toy_dataset.root).items() if folder in content] == []


def test_a_clip_that_cannot_fit_into_memory_is_refused_before_anything_is_made(grid, tmp_path):
    big = tmp_path / "big.yaml"
    big.write_text(
        Path(grid)
        .read_text()
        .replace("frames: 11", "frames: 40000\nlabels: true")
        .replace("frame_rate_hz: 10", "frame_rate_hz: 100")
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("flows.making.memory.memory_here", lambda: 4 * 10**9)
        with pytest.raises(
            InputError, match=r"40000 frames need about 7\.7 GB, and this machine has 4\.0 GB"
        ):
            make_plan(str(big), "cpu")


def test_a_road_feature_off_the_route_is_told_with_faults_of_form_and_of_rules(grid, tmp_path):
    faulty = tmp_path / "faulty.yaml"
    text = Path(grid).read_text().replace("hazard_center_m: 4", "hazard_center_m: 400")
    faulty.write_text(text.replace("precipitation_mm_h: 3,", "") + "colour: red\n")
    with pytest.raises(InputError) as raised:
        make_plan(str(faulty), "cpu")
    for rule in ("colour: unknown key", "needs precipitation_mm_h above 0", "must lie on the route of scene"):
        assert sum(rule in problem for problem in raised.value.problems) == 1, raised.value.problems


def test_faults_of_a_grids_own_catalogue_entries_are_told_with_those_of_the_grid(grid, tmp_path):
    (tmp_path / "car.yaml").write_text("mass: {value: heavy}\n")
    faulty = tmp_path / "faulty.yaml"
    faulty.write_text(Path(grid).read_text() + f"vehicle: {tmp_path / 'car.yaml'}\nsurface: ice-rink\n")
    with pytest.raises(InputError) as raised:
        make_plan(str(faulty), "cpu")
    told = str(raised.value)
    assert "car.yaml: sprung_mass is missing" in told and "ice-rink: no such surface" in told


def test_a_run_that_waited_while_another_ended_makes_nothing_and_leaves_nothing(grid, whole, tmp_path):
    """Between looking for the manifest and taking the lock, another run can end."""
    folder = tmp_path / "data"
    real = flows.making.generate.sole_writer

    @contextmanager
    def late(layout: Layout) -> Iterator[None]:
        patch.undo()
        make(grid, folder)
        with real(layout):
            yield

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(flows.making.generate, "sole_writer", late)
        report = generate_dataset(grid, str(folder), runner="threads", workers=1, pictures=False)
    assert report.made == 0 and files_of(folder) == whole


def test_a_damaged_note_of_where_a_scene_lies_is_made_anew(toy_dataset, tmp_path, monkeypatch):
    monkeypatch.setattr("flows.making.locations.cache_root", lambda: tmp_path)
    scene, digest = toy_dataset.root.parent / "scene", "0" * 64
    note_location(digest, scene)
    (note,) = (tmp_path / "places").iterdir()
    for damage in (b"", b"[1]", b"{"):
        note.write_bytes(damage)
        assert noted_location(digest) is None
        note_location(digest, scene)
        assert noted_location(digest) == scene
