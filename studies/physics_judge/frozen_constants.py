"""What the physics judge takes as given: numbers of a dataset's frozen car, tyre and pavement."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from catalogs.documents import parse_yaml
from catalogs.tyres import tyre_entries
from flows.making.catalogue import Catalogue
from flows.making.plan import TICK_RATE_HZ
from flows.store.layout import Layout
from flows.store.sealed import read_plan_record, recorded_grid
from manifests.manifest import is_driven
from studies.physics_judge.laws.constants import Constants, TyreTables
from tasks.errors import InputError
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.paper.low_speed import SteadyStop
from tasks.vehicle.parameters import Vehicle


def read_constants(root: Path) -> Constants:
    """The frozen car and pavement of a dataset, as numbers by name, in SI.

    Raises
    ------
    InputError
        If a file is missing or has a wrong form.
    """
    layout = Layout(root)
    files = {name: layout.inputs / f"{name}.yaml" for name in ("vehicle", "surface")}
    missing = [
        f"{path}: no such file; is {root} a finished muSync dataset?"
        for path in files.values()
        if not path.is_file()
    ]
    if missing:
        raise InputError(missing)
    catalogue = Catalogue(layout.inputs)
    vehicle, pavement = catalogue.vehicle, catalogue.surface  # of the form that they must have
    car = parse_yaml(catalogue.vehicle_file.content, files["vehicle"], "catalogue entry")
    record = read_plan_record(layout)
    settings = recorded_grid(record["grid"], layout.plan)
    tyre = catalogue.vehicle_file.tyre
    return make_constants(
        _convert_numbers(car), vehicle, pavement, mode=settings.vehicle_mode,
        ticks_per_frame=TICK_RATE_HZ / settings.frame_rate_hz, steady=catalogue.steady,
        tyre=None if tyre is None else tyre_entries(tyre[1]), policy=is_driven(record["inputs"]),
    )  # fmt: skip


def make_constants(
    car: Mapping[str, float], vehicle: Vehicle, pavement: SurfaceParameters, *, mode: str, ticks_per_frame: float,
    steady: SteadyStop | None, tyre: Mapping[str, str] | None = None, policy: bool = False,
) -> Constants:  # fmt: skip
    """Return what the judge takes as given.

    Parameters
    ----------
    car : mechanical numbers of the vehicle, in SI
    vehicle : its tyre families, effects and forms
    pavement : the road's surface
    mode : paper or coupled
    ticks_per_frame : ticks from one frame to the next [1]
    steady : how the end of a stop is kept steady; None takes the published rule literally
    tyre : entries of the tyre's property file; None for Burckhardt's curves
    policy : whether a policy braked
    """
    grows = mode == "coupled"
    return Constants(
        car=car,
        surface={name: value for name, value in vars(pavement).items() if isinstance(value, float)},
        tyres={kind: TyreTables(**vars(vehicle.find_tyre_family(kind))) for kind in vehicle.find_weathers()},
        mode=mode, ticks_per_frame=ticks_per_frame,
        steady_limit=0.0 if steady is None else steady.explicit_limit,
        held_share=0.0 if steady is None else steady.held_share,
        low_speed_rule=steady is None or steady.pitch_rule,
        tyre=tyre, policy=policy,
        # the paper's mode knows no effect
        effects={name: value for name, value in vehicle.effects.items() if value and grows},
        forms=tuple((form.port, form.variable) for form in vehicle.forms if grows),
    )  # fmt: skip


def _convert_numbers(entry: dict[str, Any]) -> dict[str, float]:
    scalars = {
        k: v for k, v in entry.items() if isinstance(v, dict) and isinstance(v.get("value"), (int, float))
    }
    return {
        name: float(np.deg2rad(item["value"])) if item.get("unit") == "deg" else float(item["value"])
        for name, item in scalars.items()
    }
