"""One clip from its scenario to its committed receipt, in five steps: surface, rollout, frames, check, commit.

This is the work that is fanned out. A clip is made whole by one worker. Its frames and tables are written first and its
receipt last, by rename: where the receipt exists, the clip is complete. Making a clip twice writes the same bytes.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from catalogs.studies.ablation import cut_coupling
from flows.making.catalogue import Catalogue, catalogue_of
from flows.making.driven import drive_by_pressures
from flows.making.driving import (
    collect_ranged_figures,
    collect_surface_figures,
    peak_lateral_demand,
    simulate_drive,
    surface_of,
    weather_of,
)
from flows.making.gate import judge_motion, nothing_to_judge
from flows.making.locations import note_location
from flows.making.pictures import frame_rows, gather_motion, render_frames, rig_of
from flows.making.plan import ClipPlan, Plan, read_plan
from flows.making.road_users import RANGED, judge_road_users
from flows.making.traced import replay_drive, unknown_ranges
from flows.running.processors import measure_peak_memory
from flows.store.address import find_local, send_files
from flows.store.frames import buffer_hash, write_clip
from flows.store.layout import OBJECTS, STAGED_TABLES, Layout, write_json
from flows.store.object_tables import hash_objects, make_object_table
from flows.store.telemetry import content_hash, labelled_table, write_parquet
from manifests.canonical import sha256_of_file
from tasks.errors import InputError
from tasks.render.camera import Camera, measure_mount
from tasks.render.object_truth import measure_objects
from tasks.studies.label_ranges import label_ranges, sampled_friction
from tasks.surface.state import SurfaceState
from tasks.vehicle.rollout import Rollout, compute_lift_times, compute_peaks

Columns = Mapping[str, NDArray[Any]]


@dataclass(frozen=True, kw_only=True)
class ClipWork:
    """A clip of a plan, with the dataset's frozen catalogue entries.

    Parameters
    ----------
    clip, plan : which, of which dataset
    catalogue : what the dataset was planned with
    """

    clip: ClipPlan
    plan: Plan
    catalogue: Catalogue

    @cached_property
    def camera(self) -> Camera:
        """The camera of the clip."""
        return self.catalogue.camera_of(int(self.clip.seed))


def make_clip(layout: Layout, index: int, scene: str) -> dict[str, Any]:
    """Make and commit a clip of a dataset.

    Parameters
    ----------
    layout : of the dataset
    index : of the clip [1]
    scene : name of its scene, or folder on this machine

    Returns
    -------
    The clip's receipt, and beside it under ``cost`` what it took
    """
    cost = Cost()
    layout = find_local(layout)
    work = open_work(layout, index, scene)

    surface = map_surface(work)
    cost.end_step("surface")
    ride, ranges = roll_out(work)
    cost.end_step("rollout")
    frames = frame_rows(ride, work.plan, work.catalogue)
    buffers = draw_frames(work, surface, ride, frames) if work.plan.settings.stores_frames else {}
    cost.end_step("frames")
    checked, verdict = check_motion(work, surface, frames, buffers)
    cost.end_step("check")
    receipt = commit_clip(layout, work, surface, ride, ranges, frames | checked, buffers, verdict)
    cost.end_step("commit")
    return receipt | {"cost": cost.as_json()}


def draw_window(layout: Layout, index: int, scene: str, shown: range) -> tuple[dict[str, NDArray[Any]], str]:
    """Return some frames of a clip, which are written nowhere, and the hash of the telemetry that they show.

    Parameters
    ----------
    layout, index, scene : as of `make_clip`
    shown : the frames; with labels the whole clip is made for them
    """
    work = open_work(layout, index, scene)
    surface, ride = map_surface(work), _move_car(work)
    frames, whole = frame_rows(ride, work.plan, work.catalogue), work.plan.settings.labels
    buffers = draw_frames(work, surface, ride, frames, None if whole else shown)
    if whole:
        buffers = {name: values[shown.start : shown.stop] for name, values in buffers.items()}
    return buffers, content_hash("ticks", ride.columns)


def warm_up(layout: Layout, scene: str) -> None:
    """Compile and load all that the clips of a dataset need: two frames of each weather, and nothing is written.

    Parameters
    ----------
    layout : of the dataset
    scene : of its first clip, as of `make_clip`
    """
    first = open_work(find_local(layout), 0, scene)
    plan = first.plan
    short = replace(plan, settings=plan.settings.model_copy(update={"frames": 2, "duration_s": None}))
    shown = [clip for clip in plan.clips if clip.scenario.scene == first.clip.scenario.scene]
    for clip in {clip.scenario.weather: clip for clip in reversed(shown)}.values():
        work = replace(first, clip=clip, plan=short)
        surface = map_surface(work)
        ride = _move_car(work)
        frames = frame_rows(ride, short, work.catalogue)
        if short.settings.stores_frames:
            check_motion(work, surface, frames, draw_frames(work, surface, ride, frames))


def open_work(layout: Layout, index: int, scene: str) -> ClipWork:
    """Read a dataset's frozen plan and the catalogue entries of a clip, both kept for the next clip.

    Parameters
    ----------
    layout : of the dataset, on this machine
    index, scene : as of `make_clip`
    """
    cv2.setNumThreads(1)  # one thread a clip: more within a frame cost more than they give
    plan = read_plan(layout.root)
    clip = plan.clips[index]
    note_location(plan.record_of(clip.scenario.scene)["sha256"], scene)
    return ClipWork(clip=clip, plan=plan, catalogue=catalogue_of(layout.root, clip.scenario.scene))


def map_surface(work: ClipWork) -> SurfaceState:
    """Step 1: the weather makes the road surface that is seen and, unless a variant cuts that, driven on."""
    return surface_of(work.clip.scenario, work.catalogue.surface)


def roll_out(work: ClipWork) -> tuple[Rollout, dict[str, float]]:
    """Step 2: the motion, and the range of each label under the bounds of the surface parameters.

    The snow's depth stays nominal, and the pressures those of a policy that braked.
    """
    scenario, catalogue = work.clip.scenario, work.catalogue
    if catalogue.traces is not None:
        return _move_car(work), unknown_ranges()

    def measure(friction: float) -> dict[str, float]:
        ride = _move_car(work, friction)
        judged = _judge_approach(work, friction, ride)
        return collect_ranged_figures(ride) | {name: judged[name] for name in RANGED if name in judged}

    felt = weather_of(cut_coupling(scenario, work.plan.settings.variant, catalogue.families))
    friction = sampled_friction(felt, catalogue.surface, catalogue.study)
    return _move_car(work), label_ranges(friction, measure)


def _move_car(work: ClipWork, friction: float | None = None) -> Rollout:
    """The motion of the vehicle, of a variant of it, or of a trace; a friction replaces the weather's [1]."""
    scenario, catalogue, plan = work.clip.scenario, work.catalogue, work.plan
    if catalogue.traces is not None:
        return replay_drive(scenario, catalogue.surface, catalogue.traces, plan.duration_s)
    if catalogue.driven is not None:
        return drive_by_pressures(scenario, work.clip.label, catalogue, plan.duration_s, friction)
    _, ride = simulate_drive(
        cut_coupling(scenario, plan.settings.variant, catalogue.families), catalogue.vehicle,
        catalogue.surface, plan.settings.vehicle_mode, plan.duration_s, catalogue.steady, catalogue.grade, friction,
    )  # fmt: skip
    return ride


def draw_frames(
    work: ClipWork, surface: SurfaceState, ride: Rollout, frames: Columns, shown: range | None = None
) -> dict[str, NDArray[Any]]:
    """Step 3: the finished frames with depth and class; ``shown`` is that of `tasks.render.clip.RigMotion`."""
    rig_at = rig_of(ride, frames, work.catalogue)
    seed = int(work.clip.seed)
    return render_frames(work.clip.scenario, surface, frames, work.plan, work.catalogue, seed, rig_at, shown)


def check_motion(
    work: ClipWork, surface: SurfaceState, frames: Columns, buffers: Columns
) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Step 4: the motion that the frames show, as columns of their table, and the verdict of the gate on it."""
    later = work.plan.settings.pictures == "later"
    found = (
        judge_motion(buffers, frames, surface.film_depth_mm, work.catalogue, work.camera)
        if buffers
        else nothing_to_judge(
            len(frames["frame"]), "frames are made later" if later else "no frames were made"
        )
    )
    verdict = found.pop("verdict")
    return found, verdict


def commit_clip(
    layout: Layout,
    work: ClipWork,
    surface: SurfaceState,
    ride: Rollout,
    ranges: dict[str, float],
    frames: Columns,
    buffers: Columns,
    verdict: Mapping[str, Any],
) -> dict[str, Any]:
    """Step 5: write frames, tables and at last the receipt, which is returned.

    Raises
    ------
    InputError
        If another run has finished the dataset meanwhile.
    """
    clip = work.clip
    if layout.manifest.is_file():
        # the driver died, another run took over, and has ended: there is nothing to commit any more
        raise InputError(f"{layout}: the dataset is finished; clip {clip.label} was made by another run")
    facts = collect_surface_figures(surface, ride)
    identity = {"clip_id": clip.clip_id, "label": clip.label, "weather": clip.scenario.weather}
    if buffers:
        write_clip(layout.frames, clip.index, buffers)
    files = [layout.frame_shard(name, clip.index) for name in buffers]
    content = {name: buffer_hash(values) for name, values in buffers.items()}
    if work.plan.settings.has_objects:
        objects = _observe_objects(work, surface, ride, frames, buffers)
        files.append(layout.object_table(clip.index))
        content[OBJECTS] = hash_objects(objects)
        write_parquet(make_object_table(objects, identity), files[-1])
    write_parquet(labelled_table(ride.columns, identity), layout.staged(clip.clip_id, "ticks"))
    write_parquet(labelled_table(frames, identity | facts), layout.staged(clip.clip_id, "frames"))
    receipt = {
        **clip.as_json(),
        "artifacts": {layout.relative(path): sha256_of_file(path) for path in files},
        "content": content | {"ticks": content_hash("ticks", ride.columns), "frames": content_hash("frames", frames)},
        "figures": _json_numbers(facts | {
            "stop_time": ride.stop_time,
            "stopping_distance": ride.stopping_distance,
            **collect_motion_figures(ride.columns),
            "lateral_demand": peak_lateral_demand(ride, work.catalogue.scene.route),
            **(measure_mount(work.camera) if work.camera.varies else {}),
            "static_pitch": ride.static_pitch,
            **_judge_approach(work, surface.friction, ride),
            "calibration_extrapolated": ride.calibration_extrapolated,
        } | ranges),
        "verdict": _json_numbers(verdict),
    }  # fmt: skip
    write_json(layout.receipt(clip.clip_id), receipt)
    tables = [layout.staged(clip.clip_id, table) for table in STAGED_TABLES]
    send_files(layout, [*files, *tables], last=layout.receipt(clip.clip_id))
    return receipt


def _observe_objects(
    work: ClipWork, surface: SurfaceState, ride: Rollout, frames: Columns, buffers: Columns
) -> dict[str, NDArray[Any]]:
    """Return the rows of a clip's road users; no columns where it has none."""
    if not work.clip.scenario.objects:
        return {}
    rig_at = rig_of(ride, frames, work.catalogue)
    motion = gather_motion(
        work.clip.scenario, surface, frames, work.plan, work.catalogue, work.camera, rig_at
    )
    return measure_objects(buffers, work.camera, motion)


def _judge_approach(work: ClipWork, friction: float, ride: Rollout) -> dict[str, float | bool]:
    """Return the outcome columns of a clip of a dataset with road users."""
    if not work.plan.settings.has_objects:
        return {}
    catalogue = work.catalogue
    return judge_road_users(
        work.clip.scenario, catalogue.road_user_sizes, catalogue.scene.route, friction, ride.columns
    )


def collect_motion_figures(columns: Columns) -> dict[str, float]:
    """Return the figures of a clip that follow from the columns of its ticks alone.

    Parameters
    ----------
    columns : of the ticks [their units]
    """
    return {
        "peak_pitch": float(columns["pitch"].max()),
        **compute_lift_times(columns),
        **compute_peaks(columns),
    }


@dataclass(kw_only=True)
class Cost:
    """What a clip takes, step by step, from the moment it is made.

    Parameters
    ----------
    began : processor time and clock of this process [s]
    steps : processor time of each step that has ended [s]
    """

    began: tuple[float, float] = field(default_factory=lambda: (time.process_time(), time.perf_counter()))
    steps: dict[str, float] = field(default_factory=dict)

    def end_step(self, name: str) -> None:
        """Keep what was spent since the last step as this one's."""
        self.steps[name] = time.process_time() - self.began[0] - sum(self.steps.values())

    def as_json(self) -> dict[str, Any]:
        """The whole, and each step."""
        return {
            "cpu_s": time.process_time() - self.began[0],
            "wall_s": time.perf_counter() - self.began[1],
            "peak_memory_mib": measure_peak_memory(),
            "steps": self.steps,
        }


def _json_numbers(values: Mapping[str, Any]) -> dict[str, Any]:
    """Plain JSON values; NaN, which means "not represented", becomes null."""
    plain = {key: value.item() if isinstance(value, np.generic) else value for key, value in values.items()}
    return {
        key: None if isinstance(value, float) and np.isnan(value) else value for key, value in plain.items()
    }
