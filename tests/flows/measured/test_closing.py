"""close-loop from a folder on disk to verdict, grown vehicle, report and ledger."""

import csv
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml
from typer.testing import CliRunner

from catalogs.entries import load
from catalogs.vehicles import open_vehicle
from flows.cli import app
from flows.making.plan import make_plan
from flows.measured import closing
from flows.measured.closing import close_loop, find_unused_tolerances, verdict_json
from flows.measured.closing_ledger import record_reading
from flows.measured.friction_pulls import describe_friction_pulls, find_pulled_runs
from flows.measured.grown_vehicle import grown_vehicle
from studies.closing_benchmark.synthetic import TOLERANCES, make_synthetic_campaign
from tasks.campaign.campaign import CHANNEL_UNITS, CHANNELS, SESSION, Campaign
from tasks.campaign.planned_runs import RunPlan
from tasks.errors import InputError
from tasks.identification.decision.answer import ChannelError, NamedEffect, OpenOdds, Parameter
from tests.flows.measured.findings import verdict_of

VEHICLE, SURFACE = load("vehicle", "paper-reference"), load("surface", "dense-asphalt")
HOSTILE = "lagging <img src=x onerror=alert(1)>"
SHORT = tuple(
    RunPlan(speed=speed, peak=peak, duration=2.6, disc_rise=rise)
    for speed, peak, rise in ((16.0, 1.2, 20.0), (20.0, -1.8, 60.0), (12.0, 0.8, 20.0), (18.0, 1.5, 100.0))
)


def write_campaign(campaign: Campaign, folder: Path) -> None:
    (folder / "runs").mkdir(parents=True)
    t = TOLERANCES
    names = (
        "pressure_gain",
        "mass",
        "pitch_gain",
        "wheel_radius",
        "suspension_damping",
        "suspension_stiffness",
    )
    tolerances = dict(zip((*names, "grade"), t.session, strict=True)) | {
        "run": {
            "initial_speed_m_s": t.initial_speed, "friction": t.friction,
            "acceleration_bias_m_s2": t.acceleration_bias, "pitch_offset_deg": t.pitch_offset,
        }
    }  # fmt: skip
    header = {
        "campaign": folder.name, "vehicle": "paper-reference", "sample_rate_hz": 100, "tolerances_1sigma": tolerances,
        "split": {
            "train": [r.name for r in campaign.train], "held_out": [r.name for r in campaign.held_out]
        },
    }  # fmt: skip
    (folder / "campaign.yaml").write_text(yaml.safe_dump(header))
    rows = [
        {
            "run": r.name, "weather": r.weather, "precipitation_mm_h": r.precipitation_mm_h,
            "snow_accumulation_h": r.snow_accumulation_h, "direction": r.direction,
            "disc_temperature_above_ambient_c": r.disc_rise, "hazard_center_m": r.hazard_center,
            "hazard_length_m": r.hazard_length, "hazard_height_m": r.hazard_height,
        }
        for r in campaign.runs
    ]  # fmt: skip
    with open(folder / "runs.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    for run in campaign.runs:
        columns = {"time": np.arange(len(run.pressure)) * run.interval, "brake_pressure": run.pressure}
        columns |= dict(zip(CHANNELS, run.response.T, strict=True))
        pq.write_table(pa.table(columns), folder / "runs" / f"{run.name}.parquet")


@pytest.fixture(scope="module")
def lagging(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = make_synthetic_campaign(VEHICLE, SURFACE, {"lag": 0.1}, 7, design=SHORT * 2)
    runs = tuple(replace(run, held_out=i >= 5) for i, run in enumerate(made.runs))
    folder = tmp_path_factory.mktemp("campaigns") / HOSTILE
    write_campaign(replace(made, runs=runs), folder)
    return folder


@pytest.fixture(scope="module")
def closed(lagging: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("closed")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MUSYNC_LEDGER", str(out / "ledger.jsonl"))
        result = CliRunner().invoke(app, ["close-loop", str(lagging), "--out", str(out), "--json"])
    assert result.exit_code == 0, result.output
    return out


def test_a_lag_in_the_data_is_named_with_its_value_and_better_predictions(closed: Path) -> None:
    verdict = json.loads((closed / "verdict.json").read_text())
    assert verdict["verdict"] == "FOUND" and [e["name"] for e in verdict["effects"]] == ["brake_lag"]
    lag = verdict["effects"][0]["parameters"]["lag"]
    assert lag["ci_low"] <= 0.1 <= lag["ci_high"] and lag["ci_high"] - lag["ci_low"] < 0.03
    speed = verdict["error"]["speed"]
    assert speed["after"] < 0.5 * speed["frozen"] and speed["ci_low"] <= speed["after"] <= speed["ci_high"]
    distance = verdict["manoeuvre_error"]["stopping_distance"]
    assert distance["unit"] == "m" and distance["after"] < 0.5 * distance["frozen"]


def test_a_tolerance_that_no_verdict_uses_is_told(tmp_path: Path) -> None:
    numbers = {
        name: {"value": value, "unit": unit, "source": "guess", "tolerance": 0.1 * value}
        for name, value, unit in (("cg_height", 0.55, "m"), ("wheel_radius", 0.33, "m"))
    }
    drag = {"value": 0.6, "unit": "m2", "source": "data sheet", "tolerance": 0.06}
    file = tmp_path / "car.yaml"
    file.write_text(yaml.safe_dump({"extends": "paper-reference", **numbers, "effects": {"drag_area": drag}}))
    assert find_unused_tolerances(open_vehicle(file)) == ["cg_height", "drag_area"]
    assert find_unused_tolerances(open_vehicle("paper-reference")) == []


def test_runs_that_grip_as_the_mapping_says_pull_no_friction(closed: Path) -> None:
    verdict = json.loads((closed / "verdict.json").read_text())
    assert list(verdict["friction_pulls_sigma"]) == json.loads((closed / "split.json").read_text())["train"]
    assert find_pulled_runs(verdict) == {}


@pytest.mark.parametrize(("kind", "in_the_lead"), [("NOTHING", True), ("FOUND", False)])
def test_runs_that_grip_less_than_the_mapping_says_are_told_beside_the_verdict(
    kind: str, in_the_lead: bool
) -> None:
    result = {"verdict": kind, "sentence": "So it is.", "reasons": ["because"]}
    result["friction_pulls_sigma"] = {"run-1": -2.4, "run-2": -3.8, "run-3": 2.6}
    told = describe_friction_pulls(result, 0.03)
    lead = "So it is. But in run-2 and run-3 the tyres do not grip as the surface mapping says."
    assert told["sentence"] == (lead if in_the_lead else "So it is.")
    assert (
        told["reasons"][0] == "because"
        and "(3.0% each): run-2 by -3.8 and run-3 by +2.6;" in told["reasons"][1]
    )
    gripping = {"verdict": kind, "friction_pulls_sigma": {"run-1": 2.4}}
    assert describe_friction_pulls(gripping, 0.03) == gripping


def test_a_lag_leaves_a_residual_that_goes_with_the_pressure_until_it_is_named(closed: Path) -> None:
    c = json.loads((closed / "verdict.json").read_text())["residual_input_correlation"]
    left = c["longitudinal_acceleration"]
    frozen, after = (np.abs(left[key]).max() for key in ("frozen", "after"))
    assert frozen > 2.0 * after and frozen > 3.0 * left["band"]


def test_the_report_needs_no_other_file_and_its_names_are_text(closed: Path) -> None:
    page = (closed / "report.html").read_text()
    text = re.sub(r"<script.*?</script>", "", page, flags=re.S)
    assert "src=" not in text.replace(HOSTILE.replace("<", "&lt;").replace(">", "&gt;"), "")
    assert text.count("href=") == text.count('href="data:,"') == 1
    assert HOSTILE not in page and HOSTILE.replace("<", "&lt;").replace(">", "&gt;") in page
    for heading in (
        "Explanations and their odds",
        "Where the residual of the training runs lies",
        "How often this method is right",
    ):
        assert heading in text
    cells = [
        re.sub(r"<.*?>", "", cell) for cell in re.findall(r"<td.*?</td>", page.split("Gains of splines")[-1])
    ]
    best, frozen, after = cells[:3]
    assert best == "brake torque over pressure rate" and float(after) < 0.2 * float(frozen)
    figures = [
        json.loads(part.split("</script>")[0]) for part in page.split('<script type="application/json">')[1:]
    ]
    assert {line["legendgroup"] for line in figures[0]["data"]} >= {
        "measured",
        "frozen",
        "after",
        "noise, 95 %",
    }
    assert [note["text"] for note in figures[-1]["layout"]["annotations"]] == [
        "longitudinal acceleration",
        "pitch",
    ]


def test_the_split_is_on_disk(closed: Path) -> None:
    split = json.loads((closed / "split.json").read_text())
    assert split["split_sha256"] == json.loads((closed / "verdict.json").read_text())["split_sha256"]
    assert not set(split["train"]) & set(split["held_out"])


def judging(seed: int, content_hash: str) -> Campaign:
    """A campaign whose runs but the first only judge."""
    made = make_synthetic_campaign(VEHICLE, SURFACE, {}, seed, design=SHORT)
    runs = tuple(replace(run, held_out=k > 0) for k, run in enumerate(made.runs))
    return replace(made, runs=runs, content_hash=content_hash)


def test_no_edit_beside_the_measured_values_makes_a_reading_the_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MUSYNC_LEDGER", str(tmp_path / "ledger.jsonl"))
    made = judging(1, "a")
    commented = replace(made, content_hash="with a comment", name="another")
    renamed = tuple(replace(run, name=f"x-{run.name}") for run in made.runs)
    variants = (
        made,
        commented,
        replace(commented, content_hash="renamed", split_hash="r", runs=renamed[::-1]),
        replace(commented, content_hash="fewer", split_hash="f", runs=made.runs[:-1]),
        replace(commented, content_hash="zero", runs=tuple(run.lower_pressure(0.01) for run in made.runs)),
    )
    assert [record_reading(c, "v") for c in variants] == [0, 1, 2, 3, 4]
    kept = json.loads((tmp_path / "ledger.jsonl").read_text().splitlines()[1])
    assert kept["content_sha256"] == "with a comment"


def test_a_run_that_was_fitted_before_is_no_blind_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MUSYNC_LEDGER", str(tmp_path / "ledger.jsonl"))
    made = judging(1, "a")
    turned = tuple(replace(run, held_out=not run.held_out) for run in made.runs)
    swapped = replace(made, content_hash="swapped", split_hash="s", runs=turned)
    assert [record_reading(c, "v") for c in (made, swapped)] == [0, 1]


def test_a_ledger_from_before_runs_were_hashed_still_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "ledger.jsonl"
    path.write_text('{"content_sha256": "a", "split_sha256": "s"}\n{"content_sha256": "b"}\n')
    monkeypatch.setenv("MUSYNC_LEDGER", str(path))
    assert record_reading(judging(1, "a"), "v") == 1


def test_a_call_that_ends_before_it_has_a_result_has_read_nothing(
    lagging: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def give_up(*_: object) -> None:
        raise MemoryError

    monkeypatch.setenv("MUSYNC_LEDGER", str(tmp_path / "ledger.jsonl"))
    monkeypatch.setattr(closing, "judge_runs", give_up)
    with pytest.raises(MemoryError):
        close_loop(str(lagging), out=str(tmp_path / "out"))
    assert not (tmp_path / "ledger.jsonl").exists()
    (tmp_path / "ledger.jsonl").write_text("no entry\n")
    with pytest.raises(InputError, match="line 1 must be a JSON object"):  # not after minutes of fitting
        close_loop(str(lagging), out=str(tmp_path / "out"))


def parameter(name: str, value: float, unit: str = "1") -> Parameter:
    return Parameter(
        name=name, value=value, ci_low=0.9 * value, ci_high=1.1 * value, lower=0.0, upper=9.0, unit=unit
    )


def named(name: str, kind: str, *parameters: Parameter) -> NamedEffect:
    return NamedEffect(
        name=name, effect_class=kind, port="p", variable="v", parameters=parameters, score=50.0, gain=60.0,
    )  # fmt: skip


def test_the_verdict_has_the_keys_that_others_read_and_is_plain_json() -> None:
    error = ChannelError(
        frozen=2.0, retuned=3.0, after=1.0, ci_low=0.5, ci_high=1.5, change_low=-2.0, change_high=-0.5, wins=3,
        worst_run="run-01", unit="m/s",
    )  # fmt: skip
    found = replace(
        verdict_of(named("aerodynamic_drag", "effect", parameter("drag_area", 0.7, "m2"))),
        error=dict.fromkeys(CHANNELS, error), manoeuvre_error={"peak_pitch": error},
        session_pulls=dict.fromkeys(SESSION, (0.0, 0.0)), noise=dict.fromkeys(CHANNELS, (0.0, 1.0)),
        detectable={"bump_stop": float("inf")},
    )  # fmt: skip
    odds = (OpenOdds(names=("aerodynamic_drag",), odds=1.0), OpenOdds(names=(), odds=0.25))
    content = verdict_json(replace(found, odds=odds), load("library of effects"))
    assert {"verdict", "effects", "rivals", "discriminating_experiment", "error"} <= set(content)
    effect = content["effects"][0]
    assert {"name", "class", "port", "variable", "parameters", "score", "gain", "spread"} <= set(effect)
    assert content["odds"] == [{"names": ["aerodynamic_drag"], "odds": 1.0}, {"names": [], "odds": 0.25}]
    assert {"value", "ci_low", "ci_high", "unit"} <= set(effect["parameters"]["drag_area"])
    assert {"frozen", "retuned", "after", "ci_low", "ci_high", "unit"} <= set(content["error"]["speed"])
    json.dumps(content, allow_nan=False)
    assert len(content["error"]) == len(CHANNEL_UNITS)


def test_the_grown_vehicle_has_the_effect_the_retuned_number_and_where_they_come_from(tmp_path: Path) -> None:
    verdict = verdict_of(
        named("aerodynamic_drag", "effect", parameter("drag_area", 0.7, "m2")),
        named("retuned_pressure_gain", "retune", parameter("pressure_gain", 0.1)),
        named("retuned_friction_level", "retune", parameter("friction", -0.05)),
    )
    text, missing = grown_vehicle(open_vehicle("paper-reference"), verdict, {})
    assert text is not None and missing == []
    path = tmp_path / "grown.yaml"
    path.write_text(text)
    grown = load("vehicle", path)
    assert grown.effects == {"drag_area": 0.7}
    assert grown.brake_gain == pytest.approx(1.1 * VEHICLE.brake_gain)
    assert grown.families["dry"].efficiency == pytest.approx((0.95 * 1.01,))
    assert grown.sprung_mass == VEHICLE.sprung_mass
    provenance = open_vehicle(path).provenance
    assert provenance is not None and provenance.mode == "coupled"
    assert provenance.data_sha256["campaign"] == "c" * 64 and "FOUND" in provenance.procedure
    assert "95 % interval 0.63 to 0.77" in text


def test_sensor_faults_do_not_change_the_car_and_what_is_not_carried_is_named() -> None:
    sensor = named("sensor_pitch_scale", "sensor", parameter("pitch_scale", 0.05))
    unheard = named("unheard_of", "effect", parameter("no_such_number", 0.05))
    assert grown_vehicle(open_vehicle("paper-reference"), verdict_of(sensor), {}) == (None, [])
    assert grown_vehicle(open_vehicle("paper-reference"), verdict_of(unheard), {}) == (
        None,
        ["unheard_of: no_such_number"],
    )


def test_a_dataset_is_planned_with_the_grown_vehicle_in_coupled_mode(tmp_path: Path) -> None:
    text, _ = grown_vehicle(
        open_vehicle("paper-reference"),
        verdict_of(named("aerodynamic_drag", "effect", parameter("drag_area", 0.7, "m2"))),
        {},
    )
    assert text is not None
    path = tmp_path / "grown.yaml"
    path.write_text(text)
    plain, _ = make_plan("demo", "cpu")
    grown, inputs = make_plan("demo", "cpu", str(path))
    assert grown.settings.vehicle_mode == "coupled" and inputs["vehicle.yaml"] == path.read_bytes()
    assert grown.inputs["vehicle.yaml"] != plain.inputs["vehicle.yaml"] and grown.run_id != plain.run_id
