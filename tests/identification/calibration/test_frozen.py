import json
import shutil
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest
import yaml
from typer.testing import CliRunner

from catalogs.entries import find_entry, load
from catalogs.vehicles import open_vehicle
from flows.cli import app
from flows.measured.agreement import measure_agreement
from flows.measured.calibration import calibrate_on_traces
from manifests.canonical import sha256_of_file
from tasks.errors import InputError
from tests.flows.measured.findings import found_effect, found_form, grown_file
from tests.identification.calibration.conftest import write_traces


@pytest.mark.parametrize("name", ["", "cars/mine", ".."])
def test_a_name_that_no_file_can_have_is_refused_before_the_fit(tmp_path, name):
    with pytest.raises(InputError, match="--name must"):
        calibrate_on_traces(str(tmp_path / "nowhere"), out=str(tmp_path / "out"), name=name)
    assert not (tmp_path / "out").exists()


def write_short_procedure(folder, *groups):
    """A procedure of one stage and one evaluation."""
    entry = yaml.safe_load(find_entry("calibration procedure", "coupled-grown").read_text())
    entry["stages"] = [
        {"name": "air", "groups": list(groups), "responses": ["speed"], "kinds": ["flat"], "phase": "braking"}
    ]
    entry["passes"]["value"] = entry["evaluations"]["value"] = 1
    (folder / "short.yaml").write_text(yaml.safe_dump(entry))
    return str(folder / "short.yaml")


@pytest.fixture(scope="module")
def calibrated(vehicle, tmp_path_factory):
    """Folder with ``traces`` and the vehicle ``car.yaml`` that was fitted to them."""
    folder = tmp_path_factory.mktemp("calibrated")
    traces = write_traces(folder / "traces", vehicle, "coupled", ("wet",))
    procedure = write_short_procedure(folder, "drag_area", "cg_to_front_axle", "static_pitch", "efficiency")
    calibrate_on_traces(str(traces), out=str(folder / "out"), procedure=procedure, name="car")
    return folder


@pytest.fixture
def frozen(calibrated, tmp_path):
    """Traces and vehicle file that a test may change."""
    shutil.copytree(calibrated / "traces", tmp_path / "traces")
    shutil.copytree(calibrated / "out", tmp_path / "out")
    return tmp_path / "traces", tmp_path / "out" / "car.yaml"


def test_a_frozen_file_says_where_its_numbers_come_from(frozen):
    traces, path = frozen
    provenance = open_vehicle(path).provenance
    assert provenance is not None
    assert (provenance.mode, provenance.base, provenance.split) == (
        "coupled",
        "paper-reference",
        "development",
    )
    assert provenance.base_sha256 == sha256_of_file(find_entry("vehicle", "paper-reference"))
    assert provenance.data_sha256 == {"wet": sha256_of_file(traces / "development" / "wet.parquet")}
    assert provenance.bounds["drag_area"].upper == 2
    assert [s.name for s in provenance.stages] == ["air"]


def test_frozen_values_are_read_back_in_their_units(frozen):
    _, path = frozen
    entry, car = yaml.safe_load(path.read_text()), load("vehicle", path)
    assert car.effects == {"drag_area": entry["effects"]["drag_area"]["value"]}
    assert np.rad2deg(car.static_pitch) == pytest.approx(entry["static_pitch"]["value"], rel=1e-12)
    assert car.wheelbase == pytest.approx(2.7, abs=1e-9)
    assert car.families["rain"].efficiency == tuple(entry["families"]["rain"]["efficiency"]["value"])


@pytest.mark.parametrize("edit", [("unit: m2", "unit: m3"), ("value: 1200", "value: 1201")])
def test_an_edited_frozen_file_is_refused(frozen, edit):
    _, path = frozen
    text = path.read_text()
    assert edit[0] in text or edit[0] == "value: 1200"
    path.write_text(text.replace(*edit, 1))
    with pytest.raises(InputError, match="must be as it was frozen"):
        load("vehicle", path)


def test_the_page_of_an_agreement_has_a_drawing_and_a_row_for_each_case(frozen, tmp_path):
    traces, path = frozen
    cases = measure_agreement(str(traces), vehicle=str(path), out=str(tmp_path))["cases"]
    page = (tmp_path / "agreement.html").read_text()
    assert page.count("<svg") == len(cases) > 0
    assert all(
        page.count(f">{row['case']}<") == 1 and f"{row['pitch_rmse_deg']:.4g}" in page for row in cases
    )


def test_a_case_that_the_paper_prints_stands_beside_its_own_row(frozen, tmp_path):
    """Table carsim_ood_per_case_supp prints Rain 5 with a pitch RMSE of .10208 deg."""
    traces, _ = frozen
    (case,) = json.loads((traces / "cases.json").read_text())
    shutil.move(traces / "development" / "wet.parquet", traces / "flat-rain5.parquet")
    (traces / "cases.json").write_text(json.dumps([case | {"case": "flat-rain5", "split": "held-out"}]))
    result = measure_agreement(str(traces))
    rows = {row["figure"]: row for row in result["beside_print"] if row["group"] == "flat-rain5"}
    assert rows["pitch_rmse_deg"]["paper_mean"] == 0.10208 and rows["event_error"]["paper_mean"] == 0.28361
    assert rows["pitch_rmse_deg"]["mean"] == result["cases"][0]["pitch_rmse_deg"]
    groups = {(group["by"], group["name"]): group for group in result["groups"]}
    assert groups.keys() == {("road", "flat"), ("weather", "weather"), ("all", "all")}
    assert groups["weather", "weather"]["cases"] == 1
    assert groups["weather", "weather"]["mean"] == groups["weather", "weather"]["maximum"] == result["mean"]


def test_agreement_drives_a_frozen_vehicle_in_the_mode_it_was_fitted_in(frozen):
    traces, path = frozen
    assert measure_agreement(str(traces), vehicle=str(path))["mode"] == "coupled"
    assert measure_agreement(str(traces), vehicle=str(path), mode="paper")["mode"] == "paper"
    assert measure_agreement(str(traces))["mode"] == "paper"


def spoil(folder, case="wet", **columns):
    path = folder / "development" / f"{case}.parquet"
    table = pq.read_table(path)
    for name, change in columns.items():
        index = table.column_names.index(name)
        if change is None:
            table = table.remove_column(index)
        else:
            table = table.set_column(index, name, [change(table[name].to_numpy())])
    pq.write_table(table, path)


def with_nan(values):
    return np.where(np.arange(len(values)) == 5, np.nan, values)


@pytest.mark.parametrize(
    ("harm", "sentence"),
    [
        (lambda f: (f / "development" / "wet.parquet").unlink(), "case wet needs wet.parquet"),
        (lambda f: spoil(f, slip_rr=None), "needs the columns slip_rr"),
        (lambda f: spoil(f, pitch=with_nan), "pitch must hold numbers throughout; 1 are not"),
        (lambda f: (f / "cases.json").unlink(), "no such file"),
    ],
)
def test_bad_traces_are_one_sentence_and_exit_code_2(vehicle, make_traces, harm, sentence, tmp_path):
    folder = make_traces(vehicle, "paper", ("wet",))
    harm(folder)
    for command in (
        ["vehicle", "calibrate", str(folder), "--out", str(tmp_path / "out")],
        ["vehicle", "agreement", str(folder)],
    ):
        result = CliRunner().invoke(app, command)
        assert isinstance(result.exception, InputError)
        assert any(sentence in problem for problem in result.exception.problems)
        assert len(result.exception.problems) == 1


def test_a_split_that_is_none_lists_those_that_exist(vehicle, make_traces, tmp_path):
    folder = make_traces(vehicle, "paper", ("wet",))
    with pytest.raises(InputError, match="no case has the split test; there are: development"):
        calibrate_on_traces(str(folder), out=str(tmp_path), split="test")


def test_conditions_may_hold_nulls_and_leave_the_onset_to_the_trace(vehicle, make_traces):
    folder = make_traces(vehicle, "paper", ("wet",))
    told = measure_agreement(str(folder))["cases"]
    rows = json.loads((folder / "cases.json").read_text())
    rows[0] |= {"brake_onset_s": None, "hazard_center_m": None, "hazard_height_m": None, "note": "unseen"}
    (folder / "cases.json").write_text(json.dumps(rows))
    with pytest.raises(InputError, match="add one of them"):
        measure_agreement(str(folder))
    path = folder / "development" / "wet.parquet"
    table = pq.read_table(path)
    pressure = np.clip(np.round(table["time"].to_numpy() - 0.3, 6) / 0.5, 0, 1) * 2.3
    pq.write_table(table.append_column("brake_pressure", [pressure]), path)
    read = measure_agreement(str(folder))["cases"]
    assert read[0]["window"] == pytest.approx(told[0]["window"], abs=1e-9)
    assert read[0]["speed_rmse_m_s"] == pytest.approx(told[0]["speed_rmse_m_s"], rel=0.01)


@pytest.mark.parametrize("mode", ["paper", "coupled"])
def test_cases_that_coast_and_cases_that_brake_at_a_place_are_driven_as_they_were(vehicle, make_traces, mode):
    cases = measure_agreement(str(make_traces(vehicle, mode, ("roll", "trigger"), noise=0.0)), mode=mode)[
        "cases"
    ]
    assert [case["event_unit"] for case in cases] == ["km/h", "m"]
    for case in cases:
        assert case["speed_rmse_m_s"] < 1e-9
        assert case["pitch_rmse_deg"] < 1e-9
        assert case["event_error"] < 2e-3


def test_traces_may_lie_beside_their_conditions(vehicle, make_traces):
    folder = make_traces(vehicle, "paper", ("wet",))
    nested = measure_agreement(str(folder))["cases"]
    shutil.move(folder / "development" / "wet.parquet", folder / "wet.parquet")
    assert measure_agreement(str(folder))["cases"] == nested


@pytest.mark.parametrize(
    ("harm", "sentence"),
    [
        (lambda e: e["bounds"].pop("efficiency"), "every group of a stage needs bounds; efficiency has none"),
        (lambda e: e["bounds"]["efficiency"].update(lower=2.0), "lower must be below upper"),
        (lambda e: e["scales"]["speed"].update(unit="km h-1"), "unit must be m s-1"),
    ],
)
def test_a_faulty_procedure_is_told_by_place_and_rule(tmp_path, harm, sentence):
    entry = yaml.safe_load(find_entry("calibration procedure", "paper-staged").read_text())
    harm(entry)
    path = tmp_path / "faulty.yaml"
    path.write_text(yaml.safe_dump(entry))
    with pytest.raises(InputError) as failure:
        load("calibration procedure", path)
    assert sentence in str(failure.value)


def test_a_vehicle_that_close_loop_grew_is_calibrated_further_and_keeps_what_it_had(make_traces, tmp_path):
    found = found_form("brake_torque", "pressure", "a + b x", 3.6, 0.0, 0.1)
    (lag,) = (e for e in load("library of effects") if e.name == "brake_lag")
    grown = grown_file(
        tmp_path / "grown.yaml", found, found_effect(lag, {"lag": 0.08}), reached={"pressure": (0.0, 3.6)}
    )
    truth = replace(load("vehicle", grown), effects={"lag": 0.08, "drag_area": 0.6})
    entry = yaml.safe_load(find_entry("calibration procedure", "coupled-grown").read_text())
    entry["stages"] = [
        {"name": "air", "groups": ["drag_area"], "responses": ["speed"], "kinds": ["flat"], "phase": "event"}
    ]
    entry["passes"]["value"] = 1
    (tmp_path / "air.yaml").write_text(yaml.safe_dump(entry))
    traces = make_traces(truth, "coupled", ("wet",))
    calibrate_on_traces(
        str(traces),
        out=str(tmp_path / "out"),
        vehicle=str(grown),
        procedure=str(tmp_path / "air.yaml"),
        name="car",
    )
    car = load("vehicle", tmp_path / "out" / "car.yaml")
    assert car.forms == truth.forms and car.effects["lag"] == 0.08
    assert car.effects["drag_area"] == pytest.approx(0.6, abs=0.1)


def test_a_vehicle_that_extends_another_is_frozen_whole(vehicle, make_traces, tmp_path):
    traces = make_traces(vehicle, "coupled", ("wet",))
    procedure, base = write_short_procedure(tmp_path, "drag_area"), tmp_path / "base.yaml"
    base.write_text("extends: paper-reference\nsprung_mass: {value: 1210, unit: kg, source: scales}\n")
    calibrate_on_traces(
        str(traces), out=str(tmp_path / "out"), vehicle=str(base), procedure=procedure, name="car"
    )
    path = tmp_path / "out" / "car.yaml"
    assert load("vehicle", path).sprung_mass == 1210 and b"extends" not in path.read_bytes()
    assert open_vehicle(path).provenance.base_sha256 != sha256_of_file(base)
