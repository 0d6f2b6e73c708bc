"""Study of the physics judge: false alarms on random clips, injected errors found, processor time a clip.

``python -m studies.physics_judge [SEED] [CLIPS]``: without a seed a fresh one is drawn and printed.
"""

import json
import secrets
import sys
import time
from typing import Any

import numpy as np

from catalogs.scenario import Scenario
from studies.physics_judge.clips import StudyClip, draw_clip, draw_vehicle, make_clip
from studies.physics_judge.errors import ERRORS, state_outcome
from studies.physics_judge.laws.audit import evaluate_laws
from studies.physics_judge.laws.law import Law
from studies.physics_judge.laws.route import RouteLine
from tasks.errors import InputError
from tasks.vehicle.rollout import Mode


def judge(clip: StudyClip, tables: tuple[Any, Any] | None = None) -> list[Law]:
    """Return the laws that a clip breaks, worst first.

    Parameters
    ----------
    clip : as its generator states it
    tables : ticks and frames that stand in the place of its own
    """
    ticks, frames = tables or (clip.ticks, clip.frames)
    facts = state_outcome(clip, ticks) if tables else clip.facts
    route = RouteLine(station=clip.route.station, T_world_rig=clip.route.T_world_rig)
    with np.errstate(all="ignore"):
        laws = evaluate_laws(ticks, frames, facts, clip.constants, route)
    return sorted((law for law in laws if law.broken), key=lambda law: -law.excess)


def draw_braked_clip(draw: np.random.Generator) -> StudyClip:
    """Return a random clip in which every error has something to change: it is held, brakes, meets a hump and stops.

    Water stands above the texture, below which the rate of the rain leaves friction by speed alone.

    Parameters
    ----------
    draw : source of the numbers
    """
    mode: Mode = ("paper", "coupled")[int(draw.integers(2))]
    speed = float(draw.uniform(35, 60))
    length, height = float(draw.uniform(1.5, 4.0)), float(draw.uniform(0.04, 0.09))
    scenario = Scenario(
        weather="rain", precipitation_mm_h=float(draw.uniform(22, 36)), initial_speed_km_h=speed,
        peak_pressure_mpa=float(draw.uniform(6, 10)), ramp_s=0.3, brake_onset_s=float(draw.uniform(0.5, 0.8)),
        hold_speed=True, hazard_center_m=speed / 3.6, hazard_length_m=length, hazard_height_m=height,
    )  # fmt: skip
    return make_clip(scenario, draw_vehicle(draw, mode), mode, duration_s=6.0)


def study_false_alarms(seed: int, clips: int) -> list[dict[str, Any]]:
    """Return name and first broken law of every sound clip that is accused.

    Parameters
    ----------
    seed : of the draw
    clips : how many [1]
    """
    draw, accused, made, cpu_s = np.random.Generator(np.random.Philox(seed)), [], 0, 0.0
    while made < clips:
        try:
            clip = draw_clip(draw)
        except InputError:  # a draw that no grid would hold
            continue
        made, started = made + 1, time.process_time()
        broken = judge(clip)
        cpu_s += time.process_time() - started
        accused += [{"clip": clip.name, **describe(broken[0])}] if broken else []
    print(f"seed {seed}: {len(accused)} of {made} sound clips accused; {cpu_s / made:.4f} CPU-s a clip")
    return accused


def study_errors(seed: int) -> dict[str, dict[str, Any] | None]:
    """Return what the judge says of each error; None where it says nothing.

    Parameters
    ----------
    seed : of the draw
    """
    draw, said = np.random.Generator(np.random.Philox(seed)), {}
    for name, error in ERRORS.items():
        while True:
            clip = draw_braked_clip(draw)
            if (
                not judge(clip)
                and np.isfinite(clip.facts["stop_time"])
                and changes(clip, tables := error(clip))
            ):
                break
        broken = judge(clip, tables)
        said[name] = {"clip": clip.name, **describe(broken[0])} if broken else None
        print(f"{name:36} {said[name] or 'NOT FOUND ' + clip.name}")
    print(f"{sum(row is not None for row in said.values())} of {len(said)} errors found")
    return said


def changes(clip: StudyClip, tables: tuple[Any, Any]) -> bool:
    """Return whether an error changes a clip: a slip that stays below the clip level is none.

    Parameters
    ----------
    clip : as its generator states it
    tables : ticks and frames with the error
    """
    pairs = ((clip.ticks, tables[0]), (clip.frames, tables[1]))
    return any(not np.array_equal(made[k], table[k], equal_nan=True) for table, made in pairs for k in table)


def describe(law: Law) -> dict[str, Any]:
    """Return a law with the place and the size of its break."""
    return {"law": law.name, "row": law.at, "size": law.size, "of": law.of, "excess": law.excess}


if __name__ == "__main__":
    chosen = int(sys.argv[1]) if len(sys.argv) > 1 else secrets.randbits(32)
    alarms = study_false_alarms(chosen, int(sys.argv[2]) if len(sys.argv) > 2 else 200)
    print(json.dumps(alarms, indent=1))
    study_errors(chosen + 1)
