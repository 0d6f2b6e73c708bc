"""A dataset in which one coupling is cut: the picture is the scenario's, the motion the variant's, and all say so."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest

from catalogs.entries import load
from catalogs.grids import FaultyGrid, GridFile
from catalogs.scenes import write_scene
from flows.auditing.audit import audit_dataset
from flows.auditing.explain import explain_frame
from flows.auditing.repair import repair_dataset
from flows.exporting.export import export_dataset
from flows.making.catalogue import Catalogue, catalogue_of
from flows.making.driving import simulate_drive
from flows.making.freezing import frozen_run, problems_of
from flows.making.generate import generate_dataset
from flows.making.plan import freeze_grid, read_plan
from flows.making.summaries import SUMMARIES
from flows.reading.describe import describe_dataset, validate_grid
from flows.reading.report import summarise_run
from flows.store.frames import read_clip
from flows.store.sealed import read_manifest
from manifests.explain import find_input_differences
from studies.paper.replay import replay_audit
from studies.physics_judge.audit_physics import audit_physics, clip_columns, clip_facts
from tasks.errors import InputError
from tests.toy_street import TOY_CAMERA, toy_street

GRID = """
name: cut
scene: {folder}/scene
camera: {camera}
frames: 3
frame_rate_hz: 5
duration_s: 6
variant: {variant}
pictures: {pictures}
base: {{initial_speed_km_h: 30, peak_pressure_mpa: 2.3, brake_onset_s: 0.2}}
scenarios: {scenarios}
"""
WET = "{light: {weather: rain, precipitation_mm_h: 5}, heavy: {weather: rain, precipitation_mm_h: 50}}"
SNOW = "{snow: {weather: snow, precipitation_mm_h: 3, snow_accumulation_h: 1}}"
CUTS = {"appearance-only": SNOW, "fixed-mu": WET, "vertical-only": WET, "no-low-speed-rule": WET}


@pytest.fixture(scope="module")
def street(tmp_path_factory):
    folder = tmp_path_factory.mktemp("street")
    write_scene(toy_street(), folder / "scene", {})
    (folder / "camera.yaml").write_text(TOY_CAMERA)
    return folder


@pytest.fixture(scope="module")
def write_grid(street, tmp_path_factory):
    """Path of a grid of that street."""

    def write(variant, scenarios, pictures=False, grid=GRID):
        path = tmp_path_factory.mktemp("grid") / "grid.yaml"
        path.write_text(
            grid.format(
                folder=street,
                camera=street / "camera.yaml" if pictures else "dashcam-480x320",
                variant=variant,
                scenarios=scenarios,
                pictures=str(pictures).lower(),
            )
        )
        return str(path)

    return write


@pytest.fixture(scope="module")
def made(write_grid, tmp_path_factory):
    """One dataset a variant; that of the snow has pictures, and so has the same snow with nothing cut."""
    folder = tmp_path_factory.mktemp("variants")
    layouts = {}
    for variant, scenarios in {**CUTS, "full": SNOW}.items():
        grid = write_grid(variant, scenarios, pictures=scenarios is SNOW)
        layouts[variant] = generate_dataset(grid, str(folder / variant), runner="threads", workers=1).layout
    return layouts


def ticks_of(layout, number=0):
    return clip_columns(layout.root, "ticks", clip_facts(layout.root)[number])


def test_appearance_only_drives_as_the_dry_car_and_looks_as_the_snow(made):
    layout = made["appearance-only"]
    facts, snow = clip_facts(layout.root)[0], clip_facts(made["full"].root)[0]
    scenario = read_plan(layout.root).clips[0].scenario
    dry = replace(scenario, weather="dry", precipitation_mm_h=0.0, snow_accumulation_h=0.0)
    _, ride = simulate_drive(
        dry,
        load("vehicle", "paper-reference"),
        load("surface", "dense-asphalt"),
        "paper",
        6.0,
        load("low-speed rule"),
    )
    for name, column in ride.columns.items():
        np.testing.assert_array_equal(ticks_of(layout)[name], column, err_msg=name)
    assert facts["stopping_distance"] == ride.stopping_distance < 0.6 * snow["stopping_distance"]
    assert facts["surface_friction"] == ride.surface_friction
    # label ranges are those of the drive too: no bound of the snow's moves a dry stop
    assert facts["stopping_distance_p95"] < snow["stopping_distance_p05"]
    # what lies on the road is what the picture shows
    assert facts["weather"] == "snow" and facts["snow_coverage"] == snow["snow_coverage"] > 0.5
    shown, white = (read_clip(made[name].frames, 0, "rgb") for name in ("appearance-only", "full"))
    np.testing.assert_array_equal(shown[0], white[0])  # before the brake: the same pose, the same snow


def test_fixed_mu_stops_alike_at_two_rates_and_keeps_its_rates_with_the_dataset(made):
    light, heavy = clip_facts(made["fixed-mu"].root)
    assert light["stopping_distance"] == heavy["stopping_distance"] > 0
    assert light["surface_friction"] == heavy["surface_friction"]
    assert light["film_depth_mm"] < heavy["film_depth_mm"]
    assert (made["fixed-mu"].inputs / "ablation.yaml").is_file()
    assert not (made["vertical-only"].inputs / "ablation.yaml").exists()


def test_the_rates_of_fixed_mu_are_those_kept_with_the_dataset(made, tmp_path):
    """A catalogue that changes later changes no dataset that is made again."""
    from catalogs.studies.ablation import cut_coupling

    for name in ("ablation.yaml", "study.yaml"):
        content = (made["fixed-mu"].inputs / name).read_text()
        (tmp_path / name).write_text(content.replace("rain: {value: 10", "rain: {value: 20"))
    families = Catalogue(tmp_path).families
    scenario = read_plan(made["fixed-mu"].root).clips[0].scenario
    assert cut_coupling(scenario, "fixed-mu", families).precipitation_mm_h == 20
    assert catalogue_of(made["fixed-mu"].root).families.rates_mm_h["rain"] == 10


def test_vertical_only_never_brakes(made):
    for number in range(2):
        ticks = ticks_of(made["vertical-only"], number)
        assert not ticks["brake_pressure_mpa"].any() and not ticks["brake_torque_f"].any()
        assert ticks["speed"].min() > 0.9 * ticks["speed"][0]
    assert all(np.isnan(row["stopping_distance"] or np.nan) for row in clip_facts(made["vertical-only"].root))


def test_without_the_low_speed_rule_the_stop_is_the_same_and_the_pitch_follows_the_deceleration(made):
    layout = made["no-low-speed-rule"]
    for number, clip in enumerate(read_plan(layout.root).clips):
        vehicle, surface = load("vehicle", "paper-reference"), load("surface", "dense-asphalt")
        _, sound = simulate_drive(clip.scenario, vehicle, surface, "paper", 6.0, load("low-speed rule"))
        ticks = ticks_of(layout, number)
        for name in ("speed", "station", "longitudinal_acceleration", "brake_torque_f", "wheel_speed_f"):
            np.testing.assert_array_equal(ticks[name], sound.columns[name], err_msg=name)
        hold = round(1000 * (sound.stop_time - 0.5))
        np.testing.assert_array_equal(ticks["pitch"][:hold], sound.columns["pitch"][:hold])
        assert np.rad2deg(np.abs(ticks["pitch"] - sound.columns["pitch"]).max()) > 0.1
    assert (layout.inputs / "no_low_speed_rule.yaml").is_file()
    assert not (made["full"].inputs / "no_low_speed_rule.yaml").exists()


@pytest.mark.parametrize("setting", ["low_speed: literal", "vehicle_mode: coupled"])
def test_a_rule_that_would_not_act_cannot_be_left_out(write_grid, setting):
    path = write_grid("no-low-speed-rule", WET, grid=GRID + setting)
    with pytest.raises(InputError, match="leaves out a rule of vehicle_mode: paper with low_speed: steady"):
        freeze_grid(load("grid", path), "t", "cpu")


@pytest.mark.parametrize("variant", CUTS)
def test_a_cut_dataset_is_made_again_byte_for_byte_and_obeys_the_laws_of_what_it_drives(made, variant):
    root = str(made[variant].root)
    assert audit_dataset(root, share=1.0, runner="threads", workers=1)["verified"]
    physics = audit_physics(root)
    assert physics["verified"], physics["clips"]
    assert explain_frame(root, clip_facts(made[variant].root)[0]["label"], 2)["agrees"]


@pytest.mark.parametrize("variant", CUTS)
def test_the_summaries_of_a_cut_dataset_are_repaired_byte_for_byte(made, variant, tmp_path):
    root = shutil.copytree(made[variant].root, tmp_path / "copy")
    before = {path: (root / path).read_bytes() for path in SUMMARIES}
    for path in before:
        (root / path).unlink()
    assert repair_dataset(str(root), runner="threads", workers=1)["repaired"]
    assert {path: (root / path).read_bytes() for path in SUMMARIES} == before


@pytest.mark.parametrize("variant", CUTS)
def test_everything_that_shows_a_cut_dataset_says_so(made, variant, tmp_path):
    layout = made[variant]
    words = f"variant {variant}"
    manifest = read_manifest(layout)
    assert manifest["grid"]["variant"] == variant
    assert set(pq.read_table(layout.telemetry / "clips.parquet")["variant"].to_pylist()) == {variant}
    assert words in describe_dataset(str(layout.root))["warning"]
    assert words in summarise_run(manifest)
    assert words in audit_physics(str(layout.root))["warning"]
    labels = [clip["label"] for clip in manifest["clips"]]
    for to, file in (("croissant", "croissant.json"), ("ro-crate", "ro-crate-metadata.json")):
        export_dataset(str(layout.root), to=to, out=str(tmp_path / to), clips=labels)
        assert words in (tmp_path / to / file).read_text()
        card = json.loads((tmp_path / to / "musync-export.json").read_text())
        assert card["variant"] == variant and words in card["warning"]


def test_a_sound_dataset_has_no_word_of_variants(made):
    """The key, the column and the input came later: where nothing is cut, records and tables are as they were."""
    layout = made["full"]
    manifest = read_manifest(layout)
    assert "variant" not in manifest["grid"] and "ablation.yaml" not in manifest["inputs"]
    assert "variant" not in pq.read_schema(layout.telemetry / "clips.parquet").names
    described = describe_dataset(str(layout.root))
    assert described["variant"] == "full" and "warning" not in described
    assert "warning" not in audit_physics(str(layout.root))


def test_a_variant_changes_ids_and_is_named_as_the_difference(write_grid, made):
    grid = load("grid", write_grid("full", WET))
    plans = {}
    for variant in ("full", *CUTS):
        settings = grid.settings.model_copy(update={"variant": variant})
        plans[variant] = freeze_grid(replace(grid, settings=settings), "t", "cpu")[0]
    assert len({plan.clips[0].clip_id for plan in plans.values()}) == 5
    assert len({plan.clips[0].seed for plan in plans.values()}) == 1  # the same drops
    rows = find_input_differences(
        read_manifest(made["fixed-mu"]), read_manifest(made["vertical-only"]), {}, {}
    )
    assert ("fixed-mu", "vertical-only") in {
        (row["a"], row["b"]) for row in rows if row["input"] == "variant"
    }


def test_a_frozen_run_keeps_its_variant_and_a_replay_drives_it(write_grid):
    path = write_grid("appearance-only", SNOW)
    run = frozen_run(load("grid", path))
    assert run["grid"]["variant"] == "appearance-only"
    bare = frozen_run(load("grid", write_grid("", SNOW, grid=GRID.replace("variant: {variant}\n", ""))))
    assert "variant" not in bare["grid"] and bare["clips"][0]["ticks"] != run["clips"][0]["ticks"]
    assert problems_of(run) == []
    assert problems_of(frozen_run(load("grid", write_grid("no-low-speed-rule", WET)))) == []
    assert replay_audit(write_grid("fixed-mu", SNOW), seeds=2)["verified"]


def test_an_unknown_variant_is_refused_and_traces_are_of_no_variant(write_grid, tmp_path):
    with pytest.raises(FaultyGrid, match="variant"):
        load("grid", write_grid("half", SNOW))
    assert GridFile(name="t", scenarios={"a": {}}).variant == "full"
    path = write_grid("vertical-only", SNOW)
    assert "variant vertical-only" in validate_grid(path)["warning"]
    with pytest.raises(InputError, match="variant must be full where --poses"):
        freeze_grid(replace(load("grid", path), poses=tmp_path), "t", "cpu")
