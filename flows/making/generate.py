"""A grid to a dataset: plan, make the missing clips, seal."""

import shutil
from collections.abc import Iterator, Mapping
from concurrent.futures import Executor
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any, Literal

from catalogs.grids import Grid
from catalogs.scenes import load_scene
from catalogs.sentences import cap_problems, name_some
from flows.making.catalogue import Catalogue
from flows.making.clip import make_clip, warm_up
from flows.making.input_changes import frozen_inputs, restore_inputs
from flows.making.locations import find_scene
from flows.making.plan import Plan, hold_plan, make_plan, plan_differences, read_plan
from flows.making.run_report import RunCost, RunReport, list_step_times
from flows.making.seal import seal_dataset
from flows.running.failures import ClipsFailed, disk_full_sentence
from flows.running.orchestration import run_as_stage
from flows.running.progress import progress_bar
from flows.running.runner import (
    RunnerChoice,
    choose_runner,
    list_runner_problems,
    open_executor,
    run_unordered,
)
from flows.store.address import (
    forget_begun,
    open_for_reading,
    open_for_writing,
    send_files,
    send_first,
    want_progress,
)
from flows.store.frames import create_arrays
from flows.store.layout import Layout, write_atomically, write_json, write_pieces
from flows.store.lock import sole_writer
from flows.store.outputs import find_dataset_problems
from flows.store.sealed import is_committed, read_manifest
from flows.store.staging import BEGUN, is_of_begun_run, left_overs, remove_left_overs
from manifests.manifest import is_quarantined
from tasks.errors import InputError
from tasks.render.camera import Camera
from tasks.render.rasterise.backend import select_backend


def generate_dataset(
    grid: str | Grid,
    out: str,
    *,
    runner: RunnerChoice = "auto",
    workers: int | None = None,
    scheduler: str | None = None,
    backend: str = "auto",
    vehicle: str | None = None,
    pictures: bool | Literal["later"] = True,
) -> RunReport:
    """Make the dataset of ``grid`` in ``out``, or what is missing of it; ``vehicle`` takes the grid's place.

    Of a grid with ``poses`` each clip shows the motion of the trace with its conditions. Of ``pictures`` False
    makes telemetry alone, of the same clips, and ``later`` frames when they are read.
    The runner ``auto`` is that of `flows.running.runner.choose_runner`.

    Raises
    ------
    InputError
        For a faulty grid, a runner that does not exist, a folder that holds something else, or traces that do not show
        what the grid asks for.
    ClipsFailed
        If clips failed, and not for want of an input; run the same command again to make just those.
    """
    missing: list[int] = []
    cost = RunCost()
    quarantined: dict[str, list[str]] | None = None
    with open_for_writing(out, want_progress) as layout:
        wrong = list_runner_problems(choose_runner(runner, pictures is True, scheduler), scheduler)
        try:
            plan, inputs = make_plan(grid, select_backend(backend).name, vehicle, pictures=pictures)
        except InputError as error:
            raise InputError([*wrong, *error.problems]) from None
        if wrong:
            raise InputError(wrong)
        _refuse_other_content(layout)
        if layout.manifest.is_file():
            _refuse_other_plan(layout, plan, inputs)
            _clear_up(layout)
        else:
            with sole_writer(layout):
                run_as_stage(prepare_dataset)(layout, plan, inputs)
                if not layout.manifest.is_file():  # or another run has ended just now
                    rows = plan.settings.rows_per_clip
                    missing = [
                        clip.index for clip in plan.clips if not is_committed(layout, clip.as_json(), rows)
                    ]
                    with open_workers(layout, plan, runner, workers, scheduler) as executor:
                        cost = run_as_stage(fan_out)(layout, plan, missing, executor)
                        quarantined = run_as_stage(seal_dataset)(layout, plan, executor)
    finished = open_for_reading(out, is_preview)
    return RunReport(
        layout=finished,
        run_id=plan.run_id,
        clips=len(plan.clips),
        made=len(missing),
        quarantined=_read_quarantined(finished) if quarantined is None else quarantined,
        cost=cost,
    )


def _clear_up(layout: Layout) -> None:
    """Remove what a run left that was stopped between its manifest and its end; a run that is there does so itself."""
    if layout.staging.is_dir() or left_overs(layout):
        with suppress(InputError, OSError), sole_writer(layout):
            remove_left_overs(layout)


def is_preview(name: str) -> bool:
    """Whether a file is shown when a run has ended."""
    return name.startswith("previews/")


def _read_quarantined(layout: Layout) -> dict[str, list[str]]:
    clips = read_manifest(layout)["clips"]
    return {clip["label"]: clip["verdict"]["reasons"] for clip in clips if is_quarantined(clip)}


def prepare_dataset(layout: Layout, plan: Plan, inputs: Mapping[str, bytes]) -> None:
    """Lay out the folder and freeze the plan in it; a folder that holds the same plan is left as it is.

    Parameters
    ----------
    layout : of the dataset, held for writing
    plan, inputs : as of `flows.making.plan.make_plan`

    Raises
    ------
    InputError
        If the folder holds the plan of another run.
    """
    remove_left_overs(layout)
    if layout.plan.is_file():
        _refuse_other_plan(layout, plan, inputs)
        restore_inputs(layout, inputs)
        return
    # what lies there without a plan is what a run began that was stopped
    forget_begun(layout)
    for folder in (layout.inputs, layout.frames):
        if folder.exists():
            shutil.rmtree(folder)
    write_atomically(layout.staging / BEGUN, b"")
    for name, content in inputs.items():
        write_atomically(layout.inputs / name, content)
    write_json(layout.inputs / "grid.json", plan.settings.model_dump(mode="json"))
    create_frame_arrays(layout, plan)
    prepared = [
        path for folder in (layout.inputs, layout.frames) for path in folder.rglob("*") if path.is_file()
    ]
    # last: where the plan exists, the folder is ready to be filled
    write_pieces(layout.plan, plan.file_pieces())
    send_files(layout, prepared)
    send_first(layout, layout.plan)


def _refuse_other_content(layout: Layout) -> None:
    """Raise `InputError` unless the folder is new, empty, a dataset or one that a stopped run began, and in none."""
    if problems := find_dataset_problems(layout, layout.root.parent):
        raise InputError(problems)
    if layout.plan.is_file() or layout.manifest.is_file() or not layout.root.exists():
        return
    if not layout.root.is_dir() or not all(
        is_of_begun_run(layout, path.name) for path in layout.root.iterdir()
    ):
        raise InputError(
            f"{layout}: must be an empty or new folder, or a muSync dataset; it holds other files"
        )


def _refuse_other_plan(layout: Layout, plan: Plan, inputs: Mapping[str, bytes]) -> None:
    existing = read_plan(layout.root)
    if existing.as_json() == plan.as_json():
        return
    theirs = frozen_inputs(layout, existing.inputs)
    differences = plan_differences(existing.as_json(), plan.as_json(), theirs, inputs)
    shown = cap_problems([f"{layout}: holds the dataset of another run: {one}" for one in differences])
    raise InputError([*shown, f"{layout}: give an empty folder, or go on there with what made it"])


def create_frame_arrays(layout: Layout, plan: Plan) -> None:
    """Create the empty Zarr arrays of a plan; none where frames are not stored: Zarr would read black pictures."""
    if plan.settings.stores_frames:
        create_arrays(layout.frames, **describe_frame_arrays(layout, plan))


def describe_frame_arrays(layout: Layout, plan: Plan) -> dict[str, Any]:
    """Return the arguments of `flows.store.frames.encode_arrays` for a plan with pictures.

    Parameters
    ----------
    layout : of the dataset, which keeps its camera
    plan : of the dataset
    """
    from catalogs.entries import load
    from tasks.render.lens import Lens

    camera = load("camera", layout.inputs / "camera.yaml")
    attributes = {
        "camera": camera.name,
        **_describe_geometry(layout, plan, camera),
        "frame_rate_hz": plan.settings.frame_rate_hz,
        "axes": "rig: x forward, y left, z up (ISO 8855); camera: x right, y down, z forward",
    }
    if not camera.plain:
        attributes |= {
            "distortion": {
                name: getattr(camera.lens or Lens(), name) for name in ("k1", "k2", "p1", "p2", "k3")
            },
            "line_delay_s": camera.line_delay_s,
            "motion_blur_s": camera.exposure_s if camera.motion_blur else 0.0,
            "frame_time": "of the middle of the picture, in the middle of its exposure; rows are read downwards",
        }
    return {
        "shape": (len(plan.clips), plan.settings.frames, camera.height, camera.width),
        "labels": plan.settings.labels,
        "objects": plan.settings.has_objects,
        "attributes": attributes,
        "compression": plan.settings.compression,
    }


def _describe_geometry(layout: Layout, plan: Plan, camera: Camera) -> dict[str, Any]:
    """Intrinsics and mount of the camera; of each clip in its order where clips draw their own."""
    if not camera.varies:
        return {"K": camera.K.tolist(), "T_rig_camera": camera.T_rig_camera.tolist()}
    kept = Catalogue(layout.inputs)
    own = [kept.camera_of(int(clip.seed)) for clip in plan.clips]
    return {name: [getattr(one, name).tolist() for one in own] for name in ("K", "T_rig_camera")}


@contextmanager
def open_workers(
    layout: Layout, plan: Plan, runner: RunnerChoice, workers: int | None, scheduler: str | None
) -> Iterator[Executor]:
    """An executor whose workers make clips of a plan and gather their tables.

    Parameters
    ----------
    layout, plan : of the dataset
    runner, workers, scheduler : as of `generate_dataset`
    """
    warm = partial(warm_up, layout, find_scene(plan.record_of(plan.clips[0].scenario.scene)))
    chosen = choose_runner(runner, plan.settings.stores_frames, scheduler)
    if chosen != "threads":
        load_scene.cache_clear()  # planning read its route; the workers read it again, and this process does not
    with hold_plan(layout.root, plan), open_executor(chosen, workers, scheduler, warm) as executor:
        yield executor


def fan_out(layout: Layout, plan: Plan, indices: list[int], executor: Executor) -> RunCost:
    """Make the clips on the runner, those of one scene one after the other; returns what they cost."""
    cost, committed = RunCost(), 0
    failures: dict[str, BaseException] = {}
    named = {index: plan.clips[index].scenario.scene for index in indices}
    folders = {scene: find_scene(plan.record_of(scene)) for scene in set(named.values())}
    # a worker then loads each scene once
    jobs = ((layout, index, folders[named[index]]) for index in sorted(indices, key=lambda k: named[k] or ""))
    with progress_bar("clips", len(indices)) as advance:
        for (_, index, _), future in run_unordered(executor, make_clip, jobs):
            label, error = plan.clips[index].label, future.exception()
            if error is None:
                receipt = future.result()
                cost, committed = cost.with_clip(receipt["cost"]), committed + 1
                advance(label, facts=list_step_times(receipt))
            elif (full := disk_full_sentence(error)) is not None:
                raise InputError(f"{layout}: {committed} of {len(indices)} clips are committed; {full}")
            else:
                failures[label] = error
                advance(label, failed=True)
    wrong: dict[str, list[str]] = {}
    for label, error in failures.items():
        for problem in error.problems if isinstance(error, InputError) else []:
            wrong.setdefault(problem, []).append(label)
    if wrong and all(isinstance(error, InputError) for error in failures.values()):
        raise InputError([f"clip {name_some(labels)}: {problem}" for problem, labels in wrong.items()])
    if failures:
        first = next(iter(failures.values()))
        names = ", ".join(sorted(failures))
        raise ClipsFailed(
            f"{layout}: {len(failures)} of {len(indices)} clips failed ({names}); the first said:"
            f" {type(first).__name__}: {first}; the others are kept: run the same command again to make just these"
        ) from first
    return cost
