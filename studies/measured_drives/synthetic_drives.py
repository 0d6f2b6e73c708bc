"""Synthetic drives in A2D2's bus format, to try the brake-dive protocol where the truth is known."""

import json
from pathlib import Path
from typing import Any

from catalogs.entries import load
from flows.store.layout import write_atomically
from studies.measured_drives.bus_drive import bus_drive
from studies.measured_drives.plans import load_plan
from tasks.errors import InputError

LOGGED_UNITS = {
    "bar": "Unit_Bar", "km/h": "Unit_KiloMeterPerHour", "deg": "Unit_DegreOfArc", "deg/s": "Unit_DegreOfArcPerSecon",
    "m/s^2": "Unit_MeterPerSeconSquar",
}  # fmt: skip
"""Units as A2D2 spells them."""


def synthetic_drives(
    out: str,
    *,
    drives: int = 3,
    events: int = 46,
    seed: int = 2020,
    bus: str = "a2d2-like",
    vehicle: str = "paper-reference",
) -> dict[str, Any]:
    """Drive, brake and log: one JSON file per drive, microsecond time stamps, values in the bus's units.

    Parameters
    ----------
    out : folder for drive-1.json ...; new or empty
    drives : how many
    events : brake applications of each
    seed : of the whole set
    bus, vehicle : by name or YAML file

    Raises
    ------
    InputError
        If a number is below one or the folder holds other things.
    """
    folder = Path(out)
    problems = [
        f"--{name} must be at least 1; it is {value}"
        for name, value in (("drives", drives), ("events", events))
        if value < 1
    ]
    if folder.exists() and any(folder.iterdir()):
        problems.append(f"{folder}: synthetic drives need a new or empty folder; this one holds other things")
    if problems:
        raise InputError(problems)
    emitted, car = load_plan("bus", bus), load("vehicle", vehicle)
    friction = load("surface", "dense-asphalt").dry_friction
    files = []
    for drive in range(1, drives + 1):
        signals = bus_drive(car, friction, emitted, events=events, seed=seed, drive=drive)
        content = {
            name: {
                "unit": LOGGED_UNITS.get(signal.unit, signal.unit),
                "values": [
                    [round(t * 1e6), round(v, 6)]
                    for t, v in zip(signal.time.tolist(), signal.values.tolist(), strict=True)
                ],
            }
            for name, signal in signals.items()
        }
        file = folder / f"drive-{drive}.json"
        write_atomically(file, json.dumps(content, separators=(",", ":")).encode())
        files.append(str(file))
    return {"files": files, "drives": drives, "events": drives * events}
