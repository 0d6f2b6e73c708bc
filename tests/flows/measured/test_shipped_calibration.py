"""The calibrated vehicle that ships follows from files that ship and the reference traces, by one command."""

from dataclasses import fields

import pytest

from catalogs.entries import load
from catalogs.vehicles import open_vehicle
from flows.measured.calibration import calibrate_on_traces


@pytest.mark.minutes
def test_the_command_of_the_provenance_makes_the_vehicle(outside_data, tmp_path):
    traces, told = str(outside_data / "reference" / "multibody"), open_vehicle("multibody-grown").provenance
    calibrate_on_traces(
        traces, out=str(tmp_path), vehicle=told.base, procedure=told.procedure, split=told.split, name="again"
    )
    found = open_vehicle(tmp_path / "again.yaml").provenance
    assert found.model_copy(update={"sha256": told.sha256, "version": told.version}) == told
    made, shipped = load("vehicle", tmp_path / "again.yaml"), load("vehicle", "multibody-grown")
    # another processor rounds otherwise
    assert made.effects == pytest.approx(shipped.effects, rel=1e-3)
    for family, numbers in shipped.families.items():
        for table in ("efficiency", "slip_stiffness"):
            assert getattr(made.families[family], table) == pytest.approx(getattr(numbers, table), rel=1e-3)
    for field in fields(shipped):
        if isinstance(value := getattr(shipped, field.name), float):
            assert getattr(made, field.name) == pytest.approx(value, rel=1e-3), field.name
