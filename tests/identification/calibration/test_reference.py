"""The frozen vehicles that ship, on the multibody reference they were fitted to and on what they never saw."""

import json

import pytest

from catalogs.references import trace_file
from catalogs.vehicles import open_vehicle
from flows.measured.agreement import measure_agreement
from manifests.canonical import sha256_of_file

# docs/evidence/calibration.md, "Before and after"; speed [m/s], pitch [deg], slip [1], wheel load [N]
PRINTED = {
    "multibody-staged": {
        "development": (0.1076, 0.150, 0.1065, 79.6),
        "speed_check": (0.1179, 0.147, 0.0701, 117.9),
    },
    "multibody-grown": {
        "development": (0.0089, 0.0382, 0.0093, 23.9),
        "speed_check": (0.0191, 0.0654, 0.0142, 49.7),
    },
}
FIGURES = ("speed_rmse_m_s", "pitch_rmse_deg", "slip_rmse", "wheel_load_rmse_n")


@pytest.mark.parametrize("name", PRINTED)
def test_the_shipped_vehicle_has_the_documented_figures(outside_data, name):
    result = measure_agreement(str(outside_data / "reference" / "multibody"), vehicle=name)
    for split, expected in PRINTED[name].items():
        (found,) = (g for g in result["groups"] if (g["split"], g["group"]) == (split, "all"))
        assert [found[figure] for figure in FIGURES] == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("name", PRINTED)
def test_the_shipped_vehicle_was_fitted_to_the_development_cases_only(outside_data, name):
    folder = outside_data / "reference" / "multibody"
    cases = json.loads((folder / "cases.json").read_text())
    development = {c["case"] for c in cases if c["split"] == "development"}
    provenance = open_vehicle(name).provenance
    assert provenance is not None
    assert provenance.data_sha256 == {case: sha256_of_file(trace_file(folder, case)) for case in development}
