"""A record has one form, and one that breaks it does not pass the door."""

import json
from copy import deepcopy
from pathlib import Path

import pytest

from manifests.frozen_run import FOLDER
from manifests.records import FrozenRun, Manifest, PlanRecord, Receipt, check_record
from tasks.errors import InputError


@pytest.fixture
def manifest(toy_dataset) -> dict:
    return json.loads(toy_dataset.manifest.read_bytes())


def problems_of(form: type, value: object) -> str:
    with pytest.raises(InputError) as raised:
        check_record(form, value, "here")
    assert all(problem.startswith("here: ") for problem in raised.value.problems)
    return "\n".join(raised.value.problems)


def test_what_muSync_writes_passes_and_floats_that_canonical_json_shortened_are_floats_again(
    manifest, toy_dataset
):
    checked = check_record(Manifest, manifest, "here")
    assert checked == manifest
    assert isinstance(manifest["clips"][0]["scenario"]["precipitation_mm_h"], int)
    assert isinstance(checked["clips"][0]["scenario"]["precipitation_mm_h"], float)
    assert isinstance(checked["clips"][0]["index"], int)
    plan = json.loads(toy_dataset.plan.read_bytes())
    assert check_record(PlanRecord, plan, "here") == plan


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.json")), ids=lambda path: path.stem)
def test_every_frozen_run_that_ships_passes(path: Path):
    frozen = json.loads(path.read_bytes())
    assert check_record(FrozenRun, frozen, "here") == frozen


@pytest.mark.parametrize(
    "path",
    [
        "/etc/passwd", "../../.bashrc", "inputs/../../x", "telemetry//x", "telemetry/", "", ".", ".staging/lock",
        "manifest.json", "telemetry/.hidden", "telemetry/a\\..\\b", "telemetry/a\x00b", "telemetry/a\nb", "C:/x",
        "frames.zarr/" + "a" * 101, "/".join(["telemetry", *"abcdefghij"]), "ｉnputs/x", "Telemetry/x", "home/x",
        "./telemetry/clips.parquet", "file:///etc/passwd", "telemetry/ticks/family=*/part-0000.parquet",
        "telemetry/clips․parquet",
    ],
)  # fmt: skip
def test_a_recorded_path_is_one_that_muSync_writes(manifest, path):
    for place in ("artifacts", "clips"):
        wrong = deepcopy(manifest)
        owner = wrong if place == "artifacts" else wrong["clips"][0]
        owner["artifacts"][path] = "0" * 64
        assert "artifacts" in problems_of(Manifest, wrong)


@pytest.mark.parametrize(
    "clip_id",
    [
        "/x",
        "../x",
        "0123456789abcdeF",
        "0123456789abcde",
        "0123456789abcdef0",
        '0"); alert("',
        "",
        7,
        None,
    ],
)
def test_a_clips_id_has_sixteen_hex_digits(manifest, clip_id):
    manifest["clips"][1]["clip_id"] = clip_id
    assert "clips.1.clip_id" in problems_of(Manifest, manifest)


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("clips", 0, "scenario", "weather"), "lava"),
        (("clips", 0, "scenario", "initial_speed_km_h"), "60"),
        (("clips", 0, "scenario", "initial_speed_km_h"), True),
        (("clips", 0, "label"), "a\x1b[31mb"),
        (("clips", 0, "label"), "x" * 1001),
        (("clips", 0, "index"), 2**31),
        (("clips", 0, "index"), -1),
        (("clips", 0, "index"), True),
        (("clips", 0, "figures", "peak_pitch"), "high"),
        (("clips", 0, "verdict", "passed"), "yes"),
        (("clips", 0, "seed"), "1e3"),
        (("scene", "name"), "/home/somebody/scene"),
        (("scene", "name"), "../scene"),
        (("scene", "sha256"), "0" * 63),
        (("inputs",), {"../../.bashrc": "0" * 64}),
        (("git",), {"commit": "HEAD", "changed": False}),
        (("run_id",), "../../x"),
        (("clips",), []),
        (("clips",), [None]),
        (("clips",), "abc"),
        (("artifacts",), ["telemetry/clips.parquet"]),
        (("artifacts",), {"telemetry/clips.parquet": "not a hash"}),
    ],
)
def test_a_value_of_another_kind_is_refused_and_its_place_named(manifest, place, value):
    inner = manifest
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    assert ".".join(str(key) for key in place) in problems_of(Manifest, manifest)


@pytest.mark.parametrize("key", ["clips", "artifacts", "scene", "git", "environment", "processor"])
def test_a_missing_key_is_named(manifest, key):
    del manifest[key]
    assert f"{key} is missing" in problems_of(Manifest, manifest)


def test_a_missing_figure_and_a_strange_key_are_named_together(manifest):
    del manifest["clips"][2]["figures"]["peak_pitch"]
    manifest["licence"] = "mine"
    told = problems_of(Manifest, manifest)
    assert "clips.2.figures.peak_pitch is missing" in told and "licence: unknown key" in told


def test_two_clips_with_one_id_one_label_or_one_index_are_refused(manifest):
    for key in ("clip_id", "label", "index"):
        wrong = deepcopy(manifest)
        wrong["clips"][1][key] = wrong["clips"][0][key]
        problems_of(Manifest, wrong)


def test_a_receipt_is_a_clip_with_its_files(manifest):
    receipt = manifest["clips"][0]
    assert check_record(Receipt, receipt, "here")["clip_id"] == receipt["clip_id"]
    del receipt["artifacts"]
    assert "artifacts is missing" in problems_of(Receipt, receipt)
