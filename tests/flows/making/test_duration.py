"""Telemetry has a length of its own: to the stop, while the frames stay as asked and stay on their ticks."""

import numpy as np
import pytest

from catalogs.entries import entry_names, load
from catalogs.grids import GridFile
from flows.auditing.explain import explain_frame
from flows.making.driving import simulate_drive
from flows.making.generate import generate_dataset
from flows.making.plan import make_plan
from studies.physics_judge.audit_physics import audit_physics, clip_columns, clip_facts
from tests.toy_street import write_toy_grid

GRID = """
name: long
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 5
frame_rate_hz: 5
duration_s: 3.5
pictures: false
scenarios:
  stop: {{initial_speed_km_h: 25, peak_pressure_mpa: 2.3, brake_onset_s: 0.2}}
  bump: {{initial_speed_km_h: 40, hazard_center_m: 8, hazard_length_m: 0.6, hazard_height_m: 0.10}}
"""


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    folder = tmp_path_factory.mktemp("long")
    generate_dataset(write_toy_grid(folder, GRID), str(folder / "made"), runner="threads", workers=1)
    return folder / "made"


def test_every_frame_shows_its_tick_and_the_telemetry_goes_on_to_the_stop(dataset):
    stop, _ = clip_facts(dataset)
    ticks, frames = clip_columns(dataset, "ticks", stop), clip_columns(dataset, "frames", stop)
    assert len(ticks["t_ns"]) == 3501 and ticks["t_ns"][-1] == 3_500_000_000
    np.testing.assert_array_equal(frames["t_ns"], np.arange(5) * 200_000_000)
    np.testing.assert_array_equal(frames["pitch"], ticks["pitch"][frames["tick"]])
    assert 0.8 < stop["stop_time"] < 3.5 and stop["stopping_distance"] > 4
    assert np.isfinite(stop["stopping_distance_p95"])
    assert audit_physics(str(dataset))["clips"][0]["passed"]


@pytest.mark.parametrize("rate", [60, 30, 24, 29.97, 16])
def test_frames_of_any_rate_have_telemetry_to_the_last_one(rate, tmp_path):
    """Rates whose frame time is no whole number of milliseconds were refused when the clips were made."""
    grid = GRID.replace("frame_rate_hz: 5\nduration_s: 3.5", f"frame_rate_hz: {rate}")
    generate_dataset(write_toy_grid(tmp_path, grid), str(tmp_path / "made"), runner="threads", workers=1)
    for fact in clip_facts(tmp_path / "made"):
        ticks = clip_columns(tmp_path / "made", "ticks", fact)["t_ns"]
        shown = clip_columns(tmp_path / "made", "frames", fact)
        np.testing.assert_allclose(shown["t_ns"], np.arange(5) / rate * 1e9, atol=0.5e6)
        assert shown["tick"][-1] <= len(ticks) - 1 <= shown["tick"][-1] + 1
    assert all(row["passed"] for row in audit_physics(str(tmp_path / "made"))["clips"])


def test_the_papers_bump_lifts_wheels_and_every_answer_says_so(dataset):
    stop, bump = clip_facts(dataset)
    assert (stop["wheel_lift_time_f"], stop["wheel_lift_time_r"]) == (0, 0)
    assert bump["wheel_lift_time_f"] == pytest.approx(0.037, abs=0.002)
    assert bump["wheel_lift_time_r"] == pytest.approx(0.057, abs=0.002)
    audit = audit_physics(str(dataset))
    assert audit["wheels_lifted"] == ["bump"]
    assert [row["superposition_holds"] for row in audit["clips"]] == [True, False]
    told = explain_frame(str(dataset), "bump", 2)
    assert told["wheel_lift_time_r"] == bump["wheel_lift_time_r"]
    assert explain_frame(str(dataset), "stop", 2)["wheel_lift_time_r"] == 0


@pytest.mark.parametrize("name", entry_names("grid"))
def test_every_braking_clip_of_a_grid_that_ships_has_its_stop(name):
    grid = load("grid", name)
    settings = grid.settings
    vehicle, surface = load("vehicle", settings.vehicle), load("surface", settings.surface)
    for label, scenario in grid.scenarios:
        if scenario.peak_pressure_mpa:
            ride = simulate_drive(
                scenario,
                vehicle,
                surface,
                settings.vehicle_mode,
                settings.telemetry_s,
                load("low-speed rule"),
            )[1]
            assert np.isfinite([ride.stop_time, ride.stopping_distance]).all(), label


@pytest.mark.parametrize(
    ("duration", "rule"),
    [
        (3.9, "must reach the last frame"),
        (4.0005, "must be whole milliseconds"),
        (601, "must be at most 600 s"),
        (-1, "greater than 0"),
    ],
)
def test_a_length_that_cannot_be_is_refused(duration, rule):
    with pytest.raises(ValueError, match=rule):
        GridFile(name="t", scenarios={"a": {}}, frames=41, duration_s=duration)


def test_rule_and_length_decide_the_ids_of_clips_and_coupled_mode_has_no_rule(tmp_path):
    path = write_toy_grid(tmp_path, GRID)
    grid = load("grid", path)

    def id_of(**changes):
        changed = grid.settings.model_copy(update=changes)
        plan, inputs = make_plan(
            type(grid)(settings=changed, scenarios=grid.scenarios, tags=grid.tags), "cpu"
        )
        return plan.clips[0].clip_id, "low_speed.yaml" in inputs

    ids = {
        id_of()[0],
        id_of(low_speed="literal")[0],
        id_of(duration_s=None)[0],
        id_of(low_speed="literal", duration_s=None)[0],
    }
    assert len(ids) == 4
    assert id_of()[1] and not id_of(low_speed="literal")[1]
    coupled = id_of(vehicle_mode="coupled")
    assert coupled == id_of(vehicle_mode="coupled", low_speed="literal") and not coupled[1]
    assert coupled[0] not in ids
