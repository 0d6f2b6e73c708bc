"""Every number of a stored frame follows from those before it; where one does not, it is named."""

import json
import re
import shutil

import numpy as np
import pyarrow.parquet as pq
import pytest

from catalogs.entries import load
from flows.auditing.explain import explain_frame, format_text
from flows.making.generate import generate_dataset
from flows.store.layout import Layout
from flows.store.telemetry import write_parquet
from tasks.errors import InputError

CHAIN = [
    "surface friction",
    "tyre peak",
    "front tyre force",
    "rear tyre force",
    "road force",
    "rate of speed",
    "pitch",
]


@pytest.fixture(scope="module")
def coupled(toy_dataset, tmp_path_factory) -> Layout:
    folder = tmp_path_factory.mktemp("coupled")
    grid = (toy_dataset.root.parent / "grid.yaml").read_text()
    (folder / "grid.yaml").write_text(grid + "vehicle_mode: coupled\n")
    return generate_dataset(
        str(folder / "grid.yaml"), str(folder / "data"), runner="threads", workers=1
    ).layout


@pytest.mark.parametrize("mode", ["paper", "coupled"])
@pytest.mark.parametrize(
    ("clip", "frame"), [("dry/flat", 0), ("dry/hump", 4), ("snow-3/flat", 10), ("snow-3/hump", 4)]
)
def test_all_stored_numbers_follow(toy_dataset, coupled, mode, clip, frame):
    layout = toy_dataset if mode == "paper" else coupled
    result = explain_frame(str(layout.root), clip, frame)
    assert result["agrees"], [step for step in result["steps"] if not step["agrees"]]
    assert [s["quantity"] for s in result["steps"] if s["quantity"] in CHAIN] == CHAIN
    assert all(step["stored"] is not None for step in result["steps"] if step["quantity"] in CHAIN)


def test_the_moment_says_when_the_low_speed_rule_acts(tmp_path):
    """A stop from 5 km/h: 0.1 s before it the rule has replaced the deceleration; before the brake it has not."""
    text = """
name: slow
pictures: false
frames: 8
frame_rate_hz: 10
duration_s: 1.5
scenarios:
  stop: {initial_speed_km_h: 5, peak_pressure_mpa: 2.3, brake_onset_s: 0.1}
"""
    (tmp_path / "grid.yaml").write_text(text)
    generate_dataset(str(tmp_path / "grid.yaml"), str(tmp_path / "data"), runner="threads", workers=1)
    early, late = (
        [
            s["quantity"]
            for s in explain_frame(str(tmp_path / "data"), "stop", frame)["steps"]
            if s["symbol"] == "M_b"
        ]
        for frame in (2, 5)
    )
    assert early == ["brake-pitch moment"]
    (told,) = late
    begin, end = (float(t) for t in re.findall(r"(\d+\.\d+) s", told))
    assert "before the low-speed rule, which acts from" in told
    assert (begin, end) == (pytest.approx(0.402, abs=0.01), pytest.approx(0.662, abs=0.03))


def test_the_horizon_moves_by_the_focal_length_times_the_pitch(toy_dataset):
    """Pinhole camera: a far point turned by theta moves by f tan(theta); the toy camera has f = 80 px."""
    steps = {s["quantity"]: s for s in explain_frame(str(toy_dataset.root), "dry/flat", 8)["steps"]}
    pitch = steps["pitch"]["recomputed"]
    assert pitch > 0.005
    assert steps["shift of the horizon"]["recomputed"] == pytest.approx(-80 * np.tan(pitch), rel=1e-9)


@pytest.mark.parametrize(
    ("column", "quantity"),
    [("tyre_force_r", "rear tyre force"), ("heave", "heave"), ("surface_friction", "surface friction")],
)
def test_a_stored_number_that_does_not_follow_is_named(toy_dataset, tmp_path, column, quantity):
    shutil.copytree(toy_dataset.root, tmp_path / "copy")
    path = tmp_path / "copy" / "telemetry" / "frames" / "family=snow" / "part-0000.parquet"
    table = pq.read_table(path)
    values = table[column].to_numpy() * (1 + 1e-6)
    position = table.column_names.index(column)
    write_parquet(table.set_column(position, table.schema.field(column), [values]), path)
    result = explain_frame(str(tmp_path / "copy"), "snow-3/flat", 9)
    assert not result["agrees"]
    assert quantity in [step["quantity"] for step in result["steps"] if not step["agrees"]]


def test_the_report_is_json_and_text_with_equation_numbers(toy_dataset, tmp_path):
    result = explain_frame(str(toy_dataset.root), "snow-3/hump", 5, out=str(tmp_path))
    assert json.loads((tmp_path / "explain.json").read_text()) == result
    text = (tmp_path / "explain.txt").read_text()
    assert text == format_text(result)
    assert "snow coverage  [Eq. 3, S23]" in text and text.endswith("all stored numbers follow\n")


def test_an_unknown_clip_and_frame_are_told_together(toy_dataset):
    with pytest.raises(InputError) as caught:
        explain_frame(str(toy_dataset.root), "moon", 11)
    assert len(caught.value.problems) == 2 and "dry/flat" in caught.value.problems[0]


def test_equation_numbers_are_those_of_the_paper(outside_data):
    """Counted in the source: one number an equation environment, from S1 again in the supplement."""
    source = (outside_data / "paper" / "musync-gs.tex").read_text()
    numbers = {}
    for part, prefix in zip(source.split("\\appendix", 1), ("", "S"), strict=True):
        for count, body in enumerate(
            re.findall(r"\\begin{equation}(.*?)\\end{equation}", part, flags=re.S), 1
        ):
            label = re.search(r"\\label{eq:(\w+)}", body)
            numbers[label.group(1) if label else f"{prefix}{count}"] = f"{prefix}{count}"
            if "0.01485" in body:
                numbers["film"] = f"{prefix}{count}"
            if "I_sT" in body:
                numbers["snow"] = f"{prefix}{count}"
    cited = {
        "surface_evolution": "3", "surface_friction_mapping": "5", "tire_force": "8", "longitudinal_dynamics": "9",
        "half_car": "10", "camera_pose": "11", "app_longitudinal_complete": "S11", "app_half_car_complete": "S15",
        "app_brake_pitch": "S16", "film": "S21", "snow": "S23",
    }  # fmt: skip
    assert {label: numbers[label] for label in cited} == cited


def test_the_brake_moment_is_the_papers_with_its_printed_mass_and_height(toy_dataset):
    """Eq. S16 with m_s = 1200 kg and h_cg = 0.55 m (Table frozen_physical_params), gamma of the dry family."""
    steps = {s["symbol"]: s for s in explain_frame(str(toy_dataset.root), "dry/flat", 8)["steps"]}
    (gamma,) = set(load("vehicle", "paper-reference").families["dry"].pitch_scale)
    deceleration = -steps["dv/dt"]["stored"]
    assert deceleration > 4
    assert steps["M_b"]["recomputed"] == pytest.approx(gamma * 1200 * 0.55 * deceleration, rel=1e-12)
