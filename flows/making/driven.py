"""Clips that a policy braked: the motion that its pressures give."""

from collections.abc import Iterable
from dataclasses import replace

from catalogs.driven import PRESSURES
from catalogs.scenario import Scenario
from flows.making.catalogue import Catalogue
from flows.making.driving import hazard_of, surface_of
from manifests.manifest import is_driven
from tasks.driving.stepped import DriveSettings, simulate_pressures
from tasks.errors import InputError
from tasks.vehicle.rollout import Rollout


def drive_by_pressures(
    scenario: Scenario, label: str, catalogue: Catalogue, duration_s: float, friction: float | None = None
) -> Rollout:
    """Return the motion of a clip that a policy braked.

    Parameters
    ----------
    scenario, label : of the clip
    catalogue : entries of the dataset, with what the policy asked for
    duration_s : length of the telemetry [s]
    friction : mu of the road in place of the weather's [1]

    Raises
    ------
    InputError
        If the policy drove no such clip.
    """
    driven = catalogue.driven
    if driven is None or label not in driven.pressures:
        raise InputError(f"inputs/{PRESSURES}: must have the pressures of clip {label}; it has none")
    settings = DriveSettings(
        initial_speed=scenario.initial_speed_km_h / 3.6, duration_s=duration_s, rate_hz=driven.entry.rate_hz,
        hold_speed=scenario.hold_speed, hazard=hazard_of(scenario), grade=catalogue.grade,
    )  # fmt: skip
    surface = surface_of(scenario, catalogue.surface)
    if friction is not None:
        surface = replace(surface, friction=friction)
    return simulate_pressures(catalogue.vehicle, surface, settings, driven.pressures[label])


def refuse_driven(inputs: Iterable[str], origin: object, command: str) -> None:
    """Refuse a dataset whose brake follows from no scenario.

    Parameters
    ----------
    inputs : names of its frozen inputs
    origin : what messages call the dataset
    command : that needs the scenario's brake

    Raises
    ------
    InputError
        If a policy braked.
    """
    if is_driven(inputs):
        raise InputError(
            f"{origin}: a policy braked its clips (musync drive);"
            f" musync {command} needs a dataset whose scenarios brake"
        )
