"""What a source tree with the additions of docs/how-to can do: ``python -m tests.grown_tree FOLDER``, in that tree.

The folder holds ``grid.yaml`` and ``older``, a dataset that the tree made before the additions.
"""

import csv
import shutil
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import yaml
from typer.testing import CliRunner

from catalogs.entries import load
from flows.cli import app
from tasks.surface.road_profile import FLAT_ROAD
from tasks.surface.weather import Weather, surface_state
from tasks.vehicle.brake import BrakeCommand
from tasks.vehicle.parameters import Vehicle, compute_surface_response
from tasks.vehicle.rollout import Controls, Rollout, simulate_scenario

CAR = """\
extends: paper-reference
tyre: rational
effects:
  linear_drag: {value: 40, unit: N s m-1, source: test}
"""
GRAVEL = surface_state(Weather(kind="gravel"), load("surface", "dense-asphalt"))


def run_command(*words: object) -> str:
    """Return what ``musync WORDS`` prints; it must end with 0."""
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert result.exit_code == 0, f"{words}: {result.exit_code}, {result.exception!r}\n{result.output}"
    return result.output


def drive(vehicle: Vehicle, pressure: float) -> Rollout:
    """Return a coupled drive of one second from 20 m/s on gravel, with a brake pressure [MPa] from its start."""
    brake = BrakeCommand(
        peak_pressure_mpa=pressure, ramp_s=0.0, onset_s=0.0, onset_station_m=None, hold_s=None, release_s=0.0
    )
    controls = Controls(initial_speed=20.0, brake=brake, hold_speed_until_brake=False)
    return simulate_scenario(vehicle, GRAVEL, controls, FLAT_ROAD, mode="coupled", duration_s=1.0)


def check_tyre(vehicle: Vehicle, run: Rollout) -> None:
    """The force of each tick is the file's law: 2 u / (1 + u^2) of the peak, with u over the file's 0.12."""
    top = 0.12 / compute_surface_response(vehicle, "gravel", GRAVEL.friction).slip_stiffness
    assert run.target_slip == top and run.tyre_peak < 0.65
    for axle in "fr":
        u = run.columns[f"braking_slip_{axle}"] / top
        expected = 2 * run.tyre_peak * u / (1 + u * u) * run.columns[f"tyre_load_{axle}"]
        np.testing.assert_allclose(run.columns[f"tyre_force_{axle}"], expected, rtol=1e-9, atol=1e-9)
        assert u.max() > 0.3


def check_effect(vehicle: Vehicle) -> None:
    """At the speed of the start the drag of 40 N s/m slows the car by 40 v / m, and nothing else differs."""
    plain = replace(vehicle, effects={})
    with_effect, without = (
        drive(car, 0.0).columns["longitudinal_acceleration"][0] for car in (vehicle, plain)
    )
    mass = vehicle.sprung_mass + vehicle.unsprung_mass_f + vehicle.unsprung_mass_r
    np.testing.assert_allclose(with_effect - without, -40 * 20.0 / mass, rtol=1e-9)


def check_unit(car: Path, folder: Path, run: Rollout) -> None:
    """The FMU knows gravel by its code, and brakes on its tyre as the rollout does."""
    said = run_command("vehicle", "fmu", car, "--out", folder / "car.fmu")
    assert "gravel" in said
    if find_spec("fmpy") is None:
        return
    from tests.flows.exporting.fmu_car import Car

    unit = Car(folder / "car.fmu", folder / "unit", weather=9, road_friction=GRAVEL.friction, initial_speed=20.0,
               brake_pressure=2.3)  # fmt: skip
    for _ in range(100):
        unit.take_step(0.01)
    np.testing.assert_allclose(unit.read_row()[1], run.columns["speed"][-1], rtol=1e-9)
    unit.slave.freeInstance()


def check_dataset(data: Path, *, older: bool) -> None:
    """A dataset is audited by hashes and by laws, queried and exported; an older one lacks the new column."""
    run_command("audit", data, "--share", 1, "--runner", "threads", "--workers", 1)
    assert "verified: True" in run_command("lab", "audit-physics", data)
    answer = run_command("sql", data, "select count(suspension_travel_f) = 0 as lacks from ticks")
    assert ("True" if older else "False") in answer
    run_command("export", data, "--to", "csv", "--out", f"{data}-csv")
    files = sorted(Path(f"{data}-csv").glob("*.csv"))
    with files[0].open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(files) == 2 and len(rows) == 1001
    assert all((row["suspension_travel_f"] == "") == older for row in rows)
    assert float(rows[-1]["speed"]) < float(rows[0]["speed"])


def main(folder: Path) -> None:
    """Check each addition, and the older dataset last."""
    car = folder / "car.yaml"
    car.write_text(CAR)
    vehicle = load("vehicle", car)
    braked = drive(vehicle, 2.3)
    check_tyre(vehicle, braked)
    check_effect(vehicle)
    grid = yaml.safe_load((folder / "grid.yaml").read_text())
    grid["base"] = {"weather": "gravel"}
    for mode, named in (("paper", "paper-reference"), ("coupled", str(car))):
        (folder / f"{mode}.yaml").write_text(yaml.safe_dump(grid | {"vehicle": named, "vehicle_mode": mode}))
        run_command("validate", folder / f"{mode}.yaml")
        run_command("generate", folder / f"{mode}.yaml", "--no-frames", "--runner", "threads", "--workers", 1, "--out",
                    folder / mode)  # fmt: skip
        check_dataset(folder / mode, older=False)
    check_dataset(folder / "older", older=True)
    if shutil.which("cc"):
        check_unit(car, folder, braked)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
