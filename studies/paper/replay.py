"""The replay audit: visual seeds move the weather in the picture and nothing in the motion."""

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from catalogs.entries import load
from catalogs.studies.ablation import cut_coupling
from flows.making.catalogue import Catalogue
from flows.making.driving import collect_surface_figures, simulate_drive, surface_of
from flows.making.pictures import frame_rows, render_frames, rig_of
from flows.making.plan import ClipPlan, Plan, freeze_grid
from flows.running.progress import progress_bar
from flows.store.frames import buffer_hash
from flows.store.layout import write_atomically
from flows.store.outputs import Outputs
from tasks.conventions import TICK_CHANNELS
from tasks.errors import InputError
from tasks.render.rasterise.backend import select_backend
from tasks.surface.weather import DRY


@dataclass(frozen=True, kw_only=True)
class Replay:
    """One run: a scenario under one visual seed.

    Parameters
    ----------
    label : of the scenario
    seed : of the grid [1]
    columns : telemetry and surface state, each an array
    frames_sha256 : of its first frames
    """

    label: str
    seed: int
    columns: dict[str, NDArray[np.float64]]
    frames_sha256: str


def replay_audit(
    grid: str = "severity", *, seeds: int = 3, frames: int = 2, out: str | None = None, backend: str = "auto"
) -> dict[str, Any]:
    """Run every scenario of a grid under several visual seeds, each with its own rollout (paper, Appendix D).

    Parameters
    ----------
    grid : grid file, or the name of one that ships
    seeds : visual seeds a scenario, from the grid's own upward [1]
    frames : frames drawn a run, from the first on; two give the camera a speed [1]
    out : folder for replay.json
    backend : rasteriser

    Returns
    -------
    ``runs``, ``largest_difference`` by channel against the first seed's rollout, ``verified``: every difference is
    zero, every seed changes the pictures of which it draws anything and no other picture, and the first seed's
    picture comes out the same a second time; ``problems`` says which of these is not so

    Raises
    ------
    InputError
        For a faulty grid, or fewer than two seeds or frames.
    """
    if seeds < 2 or frames < 2:
        raise InputError(f"seeds and frames must be at least 2; they are {seeds} and {frames}")
    results = Outputs(out, "lab replay-audit", "replay.json")
    checked, name = load("grid", grid), select_backend(backend).name
    runs: list[Replay] = []
    drawn: dict[str, bool] = {}
    count = len(checked.scenarios)
    with tempfile.TemporaryDirectory() as folder, progress_bar("runs", count * (seeds + 1)) as advance:
        # the first seed comes twice: its picture must too
        for seed in (*range(checked.settings.seed, checked.settings.seed + seeds), checked.settings.seed):
            settings = checked.settings.model_copy(update={"seed": seed, "visual_seeds": 1})
            plan, inputs = freeze_grid(replace(checked, settings=settings), grid, name)
            for file, content in inputs.items():
                write_atomically(Path(folder) / file, content)
            for clip in plan.clips:
                named = clip.scenario.scene
                catalogue = Catalogue(Path(folder), named or settings.scene, named)
                runs.append(_run_clip(clip, plan, catalogue, frames))
                drawn[clip.label] = _is_drawn(clip, catalogue)
                advance(f"{clip.label} seed {seed}")
    replays, again = runs[: count * seeds], runs[count * seeds :]
    differences = _largest_differences(replays, count)
    problems = [
        f"{channel} differs by up to {size:g} between seeds" for channel, size in differences.items() if size
    ]
    for k, (label, _) in enumerate(checked.scenarios):
        pictures = {run.frames_sha256 for run in replays[k::count]}
        if len(pictures) != (seeds if drawn[label] else 1):
            problems.append(f"{label}: {seeds} seeds gave {len(pictures)} different pictures")
        if again[k].frames_sha256 != replays[k].frames_sha256:
            problems.append(f"{label}: one seed gave two pictures")
    result = {
        "verified": not problems,
        "runs": len(replays),
        "seeds": seeds,
        "channels": len(differences),
        "largest_difference": differences,
        "problems": problems,
    }
    results.write_json("replay.json", result)
    return result


def _is_drawn(clip: ClipPlan, catalogue: Catalogue) -> bool:
    """Whether the visual seed draws anything of a clip's picture.

    It draws what falls and lies, the light on a scene that knows its light, a camera with bounds, and noise.
    """
    weather, scene, camera = clip.scenario.weather, catalogue.scene, catalogue.camera
    has_noise = camera.sensor.full_well is not None
    return weather != DRY or scene.daylight is not None or camera.varies or has_noise


def _run_clip(clip: ClipPlan, plan: Plan, catalogue: Catalogue, frames: int) -> Replay:
    driven = cut_coupling(clip.scenario, plan.settings.variant, catalogue.families)
    _, ride = simulate_drive(
        driven, catalogue.vehicle, catalogue.surface, plan.settings.vehicle_mode, plan.duration_s,
        catalogue.steady, catalogue.grade,
    )  # fmt: skip
    state = surface_of(clip.scenario, catalogue.surface)
    rows = frame_rows(ride, plan, catalogue)
    shown = {name: column[:frames] for name, column in rows.items()}
    rig_at = rig_of(ride, shown, catalogue)
    buffers = render_frames(clip.scenario, state, shown, plan, catalogue, int(clip.seed), rig_at)
    columns = {channel.name: ride.columns[channel.name] for channel in TICK_CHANNELS}
    columns |= {name: np.array([value]) for name, value in collect_surface_figures(state, ride).items()} | {
        "T_world_rig": rows["T_world_rig"]
    }
    return Replay(
        label=clip.label, seed=plan.settings.seed, columns=columns, frames_sha256=buffer_hash(buffers["rgb"])
    )


def _largest_differences(runs: list[Replay], count: int) -> dict[str, float]:
    """Largest absolute difference of each channel to the first seed's run of the same scenario; NaN equals NaN."""
    return {
        name: max(
            _find_difference(run.columns[name], runs[k % count].columns[name]) for k, run in enumerate(runs)
        )
        for name in runs[0].columns
    }


def _find_difference(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    if a.shape != b.shape or (np.isnan(a.astype(float)) != np.isnan(b.astype(float))).any():
        return float("inf")
    return float(np.nanmax(np.abs(a.astype(float) - b.astype(float)), initial=0.0))
