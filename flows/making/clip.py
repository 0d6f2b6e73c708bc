"""One clip from its scenario to its committed receipt: the work that is fanned out.

A clip is made whole by one worker. Its frames and tables are written first and its receipt last, by rename:
where the receipt exists, the clip is complete. Making a clip twice writes the same bytes.
"""

import time
from collections.abc import Mapping
from dataclasses import asdict, fields, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from catalogs.grids.form import TICK_RATE_HZ
from catalogs.scenario import Scenario
from catalogs.studies.ablation import cut_coupling
from flows.making.catalogue import Catalogue, catalogue_of
from flows.making.driving import (
    collect_surface_figures,
    hazard_of,
    peak_lateral_demand,
    ranges_of,
    simulate_drive,
    surface_of,
    weather_of,
)
from flows.making.edited_scene import edit_scene
from flows.making.places import remember_place
from flows.making.plan import Plan, frame_ticks, read_plan
from flows.making.traced import replay_drive, unknown_ranges
from flows.running.processors import measure_peak_memory
from flows.store.address import find_local, send_files
from flows.store.frames import buffer_hash, write_clip
from flows.store.layout import STAGED_TABLES, Layout, write_json
from flows.store.telemetry import content_hash, labelled_table, write_parquet
from manifests.canonical import sha256_of_file
from tasks.errors import InputError
from tasks.eval.body_agreement import BodyClaim, pose_body
from tasks.eval.motion_agreement import PoseVerdict, judge_pose
from tasks.eval.poses.checks import GATE_CHECK, POSE_CHECKS, CheckedClip, JudgeCamera, prepare_clip
from tasks.eval.poses.undistort import undistort_frames
from tasks.render.camera import PIXEL_CENTRE, RigAt, body_poses, continuous_rig
from tasks.render.clip import RigMotion, render_clip
from tasks.render.rasterise.backend import select_backend
from tasks.render.weather.layers import ClipConditions
from tasks.surface.anchors import adjacent_anchors
from tasks.surface.state import SurfaceState
from tasks.vehicle.peaks import compute_peaks
from tasks.vehicle.rollout import Rollout, compute_lift_times


def make_clip(layout: Layout, index: int, scene: str) -> dict[str, Any]:
    """Make and commit clip ``index`` of a dataset whose scene lies at ``scene``; returns its receipt."""
    started = time.process_time(), time.perf_counter()
    cv2.setNumThreads(1)  # one thread a clip: more within a frame cost more than they give
    layout = find_local(layout)
    plan = read_plan(layout.root)
    remember_place(plan.scene["sha256"], scene)
    clip = plan.clips[index]
    catalogue = catalogue_of(layout.root)

    state, ride = move_car(clip.scenario, plan, catalogue)
    facts = collect_surface_figures(state, ride)
    driven = cut_coupling(clip.scenario, plan.settings.variant, catalogue.families)
    ranges = unknown_ranges() if catalogue.traces is not None else ranges_of(
        driven, catalogue.vehicle, catalogue.surface, catalogue.study,
        plan.settings.vehicle_mode, plan.duration_s, catalogue.steady, catalogue.grade,
    )  # fmt: skip
    frames = frame_rows(ride, plan, catalogue)
    buffers: dict[str, NDArray[Any]] = {}
    if plan.settings.pictures:
        rig_at = rig_of(ride, frames, catalogue)
        buffers = render_frames(clip.scenario, state, frames, plan, catalogue, int(clip.seed), rig_at)
        frames |= judge_motion(buffers, frames, state.film_depth_mm, catalogue)
    else:
        frames |= nothing_to_judge(len(frames["frame"]))
    verdict = frames.pop("verdict")

    if layout.manifest.is_file():
        # the driver died, another run took over, and has ended: there is nothing to commit any more
        raise InputError(f"{layout}: the dataset is finished; clip {clip.label} was made by another run")
    identity = {"clip_id": clip.clip_id, "label": clip.label, "weather": clip.scenario.weather}
    if plan.settings.pictures:
        write_clip(layout.frames, index, buffers)
    write_parquet(labelled_table(ride.columns, identity), layout.staged(clip.clip_id, "ticks"))
    write_parquet(labelled_table(frames, identity | facts), layout.staged(clip.clip_id, "frames"))
    shards = {name: layout.frame_shard(name, index) for name in buffers}
    receipt = {
        **clip.as_json(),
        "artifacts": {layout.relative(path): sha256_of_file(path) for path in shards.values()},
        "content": {name: buffer_hash(values) for name, values in buffers.items()}
        | {"ticks": content_hash("ticks", ride.columns), "frames": content_hash("frames", frames)},
        "figures": _json_numbers(facts | {
            "stop_time": ride.stop_time,
            "stopping_distance": ride.stopping_distance,
            **collect_motion_figures(ride.columns),
            "lateral_demand": peak_lateral_demand(ride, catalogue.scene.route),
            "static_pitch": ride.static_pitch,
            "calibration_extrapolated": ride.calibration_extrapolated,
        } | ranges),
        "verdict": verdict,
    }  # fmt: skip
    write_json(layout.receipt(clip.clip_id), receipt)
    tables = [layout.staged(clip.clip_id, table) for table in STAGED_TABLES]
    send_files(layout, [*shards.values(), *tables], last=layout.receipt(clip.clip_id))
    cost = {
        "cpu_s": time.process_time() - started[0],
        "wall_s": time.perf_counter() - started[1],
        "peak_memory_mib": measure_peak_memory(),
    }
    return receipt | {"cost": cost}


def collect_motion_figures(columns: Mapping[str, NDArray[Any]]) -> dict[str, float]:
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


def warm_up(layout: Layout, scene: str) -> None:
    """Compile and load all that the clips of a dataset need: two frames of each weather, and nothing is written."""
    root = find_local(layout).root
    plan = read_plan(root)
    remember_place(plan.scene["sha256"], scene)
    catalogue = catalogue_of(root)
    short = replace(plan, settings=plan.settings.model_copy(update={"frames": 2, "duration_s": None}))
    for clip in {clip.scenario.weather: clip for clip in reversed(plan.clips)}.values():
        state, ride = move_car(clip.scenario, short, catalogue)
        frames = frame_rows(ride, short, catalogue)
        if plan.settings.pictures:
            rig_at = rig_of(ride, frames, catalogue)
            buffers = render_frames(clip.scenario, state, frames, short, catalogue, int(clip.seed), rig_at)
            judge_motion(buffers, frames, state.film_depth_mm, catalogue)


def move_car(scenario: Scenario, plan: Plan, catalogue: Catalogue) -> tuple[SurfaceState, Rollout]:
    """Return the surface that is seen, and the motion: of the vehicle, its variant, or the dataset's trace."""
    if catalogue.traces is not None:
        return replay_drive(scenario, catalogue.surface, catalogue.traces, plan.duration_s)
    _, ride = simulate_drive(
        cut_coupling(scenario, plan.settings.variant, catalogue.families), catalogue.vehicle,
        catalogue.surface, plan.settings.vehicle_mode, plan.duration_s, catalogue.steady, catalogue.grade,
    )  # fmt: skip
    return surface_of(scenario, catalogue.surface), ride


def frame_rows(ride: Rollout, plan: Plan, catalogue: Catalogue) -> dict[str, NDArray[Any]]:
    """The tick that each frame shows, and the rig pose at it."""
    frame = np.arange(plan.settings.frames)
    tick = frame_ticks(plan.settings.frames, plan.settings.frame_rate_hz)
    rows = {"frame": frame, "tick": tick} | {name: column[tick] for name, column in ride.columns.items()}
    vehicle = catalogue.vehicle
    poses = body_poses(
        catalogue.scene.route, rows["station"], rows["heave"], rows["pitch"],
        cg_behind_front_axle=vehicle.cg_to_front_axle, cg_height=vehicle.cg_height,
    )  # fmt: skip
    return rows | {"T_world_rig": poses.reshape(len(frame), 16)}


def rig_of(ride: Rollout, frames: Mapping[str, NDArray[Any]], catalogue: Catalogue) -> RigAt:
    """Rig poses about every frame, for a camera that moves while it sees one."""
    vehicle, tick_s = catalogue.vehicle, 1 / TICK_RATE_HZ
    time_s = np.arange(len(ride.columns["station"]), dtype=np.float64) * tick_s
    return continuous_rig(
        catalogue.scene.route, time_s,
        ride.columns["station"], ride.columns["heave"], ride.columns["pitch"], frames["tick"] * tick_s,
        cg_behind_front_axle=vehicle.cg_to_front_axle, cg_height=vehicle.cg_height,
    )  # fmt: skip


def render_frames(
    scenario: Scenario,
    state: SurfaceState,
    frames: Mapping[str, NDArray[Any]],
    plan: Plan,
    catalogue: Catalogue,
    seed: int,
    rig_at: RigAt,
) -> dict[str, NDArray[Any]]:
    """Render the clip's finished frames, depth and class."""
    gaussians, relief = edit_scene(
        catalogue.scene,
        hazard_of(scenario),
        catalogue.marking,
        catalogue.weather_parameters.sky.asphalt_albedo,
    )
    return render_clip(
        replace(catalogue.scene, gaussians=gaussians),
        catalogue.camera,
        RigMotion(
            T_world_rig=frames["T_world_rig"].reshape(-1, 4, 4),
            frame_rate_hz=plan.settings.frame_rate_hz,
            rig_at=rig_at,
        ),
        ClipConditions(
            state=state,
            pavement=catalogue.surface,
            parameters=catalogue.weather_parameters,
            seed=seed,
            anchors=_anchors_of(scenario, plan, catalogue),
            refracts=plan.settings.composition == "paper",
        ),
        select_backend(plan.backend),
        relief=relief,
        labels=plan.settings.labels,
        composition=plan.settings.composition,
    )


def _anchors_of(scenario: Scenario, plan: Plan, catalogue: Catalogue) -> tuple[SurfaceState, ...]:
    """Return the anchors about the clip's rate that the paper's composition blends."""
    look = catalogue.weather_parameters.find_look(scenario.weather)
    if plan.settings.composition != "paper" or look is None or look.anchors_mm_h is None:
        return ()
    return adjacent_anchors(weather_of(scenario), look.anchors_mm_h, catalogue.surface)


def judge_motion(
    buffers: Mapping[str, NDArray[Any]],
    frames: Mapping[str, NDArray[Any]],
    film_depth_mm: float,
    catalogue: Catalogue,
) -> dict[str, Any]:
    """Motion that the gate's pose check recovers from the finished frames, compared with the telemetry."""
    camera = catalogue.camera
    shown = {name: buffers[name] for name in ("rgb", "depth", "class")}
    pinhole = undistort_frames(shown, camera.K - PIXEL_CENTRE, camera.distortion)
    recovered = POSE_CHECKS[GATE_CHECK](prepare_for_checks(pinhole, frames, film_depth_mm, catalogue))
    body = pose_body(
        frames["heave"], frames["pitch"], catalogue.vehicle.cg_to_front_axle, catalogue.vehicle.cg_height
    )
    claim = BodyClaim(T_world_rig=catalogue.scene.route.pose(frames["station"]) @ body, heave=frames["heave"])
    verdict = judge_pose(recovered, frames["pitch"], frames["station"], catalogue.gates, claim)
    return {
        "recovered_pitch": recovered.pitch,
        "recovered_progress": recovered.progress,
        "verdict": _json_numbers(asdict(verdict) | {"reasons": list(verdict.reasons)}),
    }


def prepare_for_checks(
    pinhole: Mapping[str, NDArray[Any]],
    frames: Mapping[str, NDArray[Any]],
    film_depth_mm: float,
    catalogue: Catalogue,
) -> CheckedClip:
    """Return a clip's undistorted ``rgb``, ``depth`` and ``class`` as every pose check takes them."""
    camera = catalogue.camera
    return prepare_clip(
        pinhole,
        JudgeCamera(
            K=camera.K - PIXEL_CENTRE,
            T_rig_camera=camera.T_rig_camera,
            distortion=camera.distortion,
            line_delay_s=camera.line_delay_s,
        ),
        frame_interval_s=float(frames["t_ns"][1] - frames["t_ns"][0]) * 1e-9,
        film_depth_mm=film_depth_mm,
        route_rotations=catalogue.scene.route.pose(frames["station"])[:, :3, :3],
    )


def nothing_to_judge(frames: int) -> dict[str, Any]:
    """Return the result of `judge_motion` where there is no picture: every value is not represented."""
    verdict = {figure.name: None for figure in fields(PoseVerdict)}
    return {
        "recovered_pitch": np.full(frames, np.nan),
        "recovered_progress": np.full(frames, np.nan),
        "verdict": verdict | {"reasons": ["no frames were made"]},
    }


def _json_numbers(values: Mapping[str, Any]) -> dict[str, Any]:
    """Plain JSON values; NaN, which means "not represented", becomes null."""
    plain = {key: value.item() if isinstance(value, np.generic) else value for key, value in values.items()}
    return {
        key: None if isinstance(value, float) and np.isnan(value) else value for key, value in plain.items()
    }
