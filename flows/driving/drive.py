"""``musync drive``: a grid whose clips a policy brakes, as an ordinary dataset."""

from dataclasses import fields, replace
from typing import Any, Literal

from catalogs.driven import DrivenClips, PolicyEntry, encode_driven
from catalogs.entries import load
from catalogs.grids import Grid
from catalogs.sentences import cap_problems
from flows.driving.policy import Policy, drive_with, load_policy
from flows.driving.simulator import UNBRAKED, Simulator
from flows.making.generate import generate_dataset
from flows.making.grid_entries import read_entries
from flows.making.plan import name_clip
from flows.making.request import list_facts
from flows.running.progress import progress_bar
from tasks.driving.outcome import describe_outcome
from tasks.driving.stepped import TICKS_PER_S, count_ticks
from tasks.errors import InputError


def drive_grid(
    grid: str,
    policy: str,
    out: str,
    *,
    rate_hz: float = 20.0,
    pictures: bool | Literal["later"] = True,
    **execution: Any,
) -> dict[str, Any]:
    """Make the dataset of a grid whose clips a policy brakes.

    Every clip is driven first, without pictures, and what the policy asked for is kept with the dataset. Its commands
    take the pressures from there and never run the policy.

    Parameters
    ----------
    grid : grid file or name, with ``vehicle_mode: coupled`` and without a brake
    policy : ``module:function``
    out : dataset folder, or its address in an object store
    rate_hz : how often the policy is asked, whole milliseconds apart [Hz]
    pictures, execution : as of `flows.making.request.make_dataset`

    Returns
    -------
    As `make_dataset`, and ``policy`` with its ``source_sha256``; of scenarios with road users ``outcomes[]``: scenario,
    number and kind of the road user, ``collided``, ``impact_speed_km_h``, ``min_ttc_s``, ``clearance_m``,
    ``avoided_km_h``.

    Raises
    ------
    InputError
        For a grid that brakes by itself, a policy that cannot be asked, or one that answers otherwise the second time;
        then nothing is written.
    """
    asked: Grid = load("grid", grid)
    found = load_policy(policy)
    if problems := _find_problems(asked, rate_hz):
        raise InputError([f"{grid}: {problem}" for problem in problems])
    pressures, outcomes = _drive_clips(asked, found, rate_hz)
    entry = PolicyEntry(policy=found.name, source_sha256=found.source_sha256, rate_hz=float(rate_hz))
    files = encode_driven(DrivenClips(entry=entry, pressures=pressures), found.source)
    report = generate_dataset(replace(asked, driven=files), out, pictures=pictures, **execution)
    return list_facts(report) | {
        "policy": found.name,
        "source_sha256": found.source_sha256,
        "outcomes": outcomes,
    }


def _find_problems(grid: Grid, rate_hz: float) -> list[str]:
    settings, problems = grid.settings, []
    if settings.vehicle_mode != "coupled":
        problems.append(f"vehicle_mode must be coupled where a policy drives; it is {settings.vehicle_mode}")
    if settings.variant != "full":
        problems.append(f"variant must be full where a policy drives; it is {settings.variant}")
    ticks = count_ticks(rate_hz)
    if round(settings.telemetry_s * TICKS_PER_S) % ticks:
        problems.append(
            f"duration_s must be whole steps of {ticks / TICKS_PER_S:g} s; it is {settings.telemetry_s:g} s"
        )
    plain = {field.name: field.default for field in fields(type(grid.scenarios[0][1]))}
    problems += [
        f"scenario {label}: {name} is the policy's, which brakes; it is {getattr(scenario, name)}: leave it out"
        for label, scenario in grid.scenarios
        for name in UNBRAKED
        if getattr(scenario, name) != plain[name]
    ]
    return cap_problems(problems)


def _drive_clips(
    grid: Grid, policy: Policy, rate_hz: float
) -> tuple[dict[str, list[float]], list[dict[str, Any]]]:
    """Pressures of each clip by its label, and outcomes of the scenarios; the first is driven twice."""
    settings = grid.settings
    entries = read_entries(settings, {scenario.weather for _, scenario in grid.scenarios})
    if entries.problems:
        raise InputError(entries.problems)
    driven: dict[str, list[float]] = {}
    outcomes: list[dict[str, Any]] = []
    with progress_bar("driven", len(grid.scenarios)) as advance:
        for label, scenario in grid.scenarios:
            simulator = Simulator(
                replace(scenario, scene=scenario.scene or settings.scene), vehicle=entries.vehicle,
                surface=entries.surface, rate_hz=rate_hz, duration_s=settings.telemetry_s, camera=policy.camera,
            )  # fmt: skip
            pressures = drive_with(policy, simulator, f"clip {label}")
            if not driven and drive_with(policy, simulator, f"clip {label}") != pressures:
                raise InputError(
                    f"policy {policy.name}: clip {label}: must ask for the same pressures in the same drive; asked"
                    " again it asks for others: take chance and memory out, or make it a class"
                )
            found = simulator.judge()
            outcomes += [
                {"scenario": label, "number": number, "kind": user.kind} | describe_outcome(outcome)
                for number, (user, outcome) in enumerate(zip(scenario.objects, found, strict=True), start=1)
            ]
            for seed in range(settings.seed, settings.seed + settings.visual_seeds):
                driven[name_clip(label, seed, settings.visual_seeds)] = pressures
            advance(label)
    return driven, outcomes
