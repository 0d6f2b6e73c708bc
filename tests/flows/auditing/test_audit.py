"""An audit that finds a difference says where it begins and which input can be why."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import flows.auditing.audit
import manifests.explain
from catalogs.scenes import load_scene, write_scene
from flows.auditing.audit import audit_dataset, draw_clips, format_text
from flows.making.generate import generate_dataset
from flows.running.processors import count_processors
from flows.store.layout import Layout
from studies.evaluation.evaluation import evaluate_dataset
from studies.negative_controls.study import run_controls
from tasks.errors import InputError
from tests.conftest import own_notes
from tests.toy_street import TOY_CAMERA, toy_street, write_toy_grid


@pytest.fixture
def copy(toy_dataset, tmp_path) -> Layout:
    shutil.copytree(toy_dataset.root, tmp_path / "copy")
    return Layout(tmp_path / "copy")


@pytest.fixture(scope="module")
def own_folder(tmp_path_factory) -> Path:
    """A dataset in ``data``, whose scene and camera are these tests' own, with its own note of where they lie."""
    folder = tmp_path_factory.mktemp("own")
    with own_notes(folder / "notes"):
        generate_dataset(write_toy_grid(folder, frames=2), str(folder / "data"), runner="threads", workers=1)
    return folder


@pytest.fixture
def own_dataset(own_folder) -> Iterator[Layout]:
    """That dataset; after a test that changes its scene or camera both are as they were."""
    with own_notes(own_folder / "notes"):
        yield Layout(own_folder / "data")
    shutil.rmtree(own_folder / "scene", ignore_errors=True)
    write_toy_grid(own_folder, frames=2)
    load_scene.cache_clear()


def audited(layout: Layout, **options) -> dict:
    return audit_dataset(str(layout.root), **{"share": 0.25, "runner": "threads", "workers": 1} | options)


def test_a_changed_catalogue_value_is_named_with_both_values_and_as_the_reason(copy, tmp_path):
    file = copy.inputs / "vehicle.yaml"
    file.write_text(file.read_text().replace("cg_height: {value: 0.55", "cg_height: {value: 0.6"))
    result = audited(copy, out=str(tmp_path / "told"))
    assert result["differences"] == ["vehicle.yaml cg_height.value: 0.55 made it, 0.6 is here"]
    (mismatch,) = result["mismatches"]
    assert (mismatch["stage"], mismatch["why"]) == ("vehicle", ["vehicle.yaml"])
    text = (tmp_path / "told" / "audit.txt").read_text()
    assert text == format_text(result) and "can come from: vehicle.yaml" in text
    assert f"tick {mismatch['tick']}: {mismatch['recorded']!r} recorded, {mismatch['remade']!r}" in text


def test_a_changed_parameter_of_a_clip_is_named(copy):
    plan = json.loads(copy.plan.read_text())
    for clip in plan["clips"]:
        clip["scenario"]["initial_speed_km_h"] += 1
    copy.plan.write_text(json.dumps(plan))
    result = audited(copy)
    assert "parameters dry/flat.initial_speed_km_h: 40.0 made it, 41.0 is here" in result["differences"]
    assert result["mismatches"][0]["why"] == ["parameters"]


def test_another_library_another_processor_and_another_code_are_named(copy, monkeypatch):
    """The look is changed in the recorded hash, so that there is a mismatch whose reason is asked for."""
    manifest = json.loads(copy.manifest.read_bytes())
    for clip in manifest["clips"]:
        clip["content"]["rgb"] = "0" * 64
    copy.manifest.write_text(json.dumps(manifest))
    here = manifests.explain.tools_here()
    here["made_with"]["libraries"]["numpy"] = "9.9"
    here["made_with"]["code"]["source_sha256"] = "0" * 64
    here["processor"]["vector_extensions"] = "none"
    monkeypatch.setattr("flows.making.input_changes.tools_here", lambda: here)
    result = audited(copy)
    assert [line.split(":")[0] for line in result["differences"]] == [
        "code source_sha256", "libraries numpy", "processor vector_extensions"
    ]  # fmt: skip
    assert result["mismatches"][0]["why"] == ["code", "libraries", "processor"]


def test_inputs_from_which_nothing_can_be_made_are_damage_and_no_crash(copy):
    (copy.inputs / "surface.yaml").unlink()
    result = audited(copy)
    assert not result["verified"] and result["rerun"] == [] and result["not_remade"]
    assert [row["path"] for row in result["damaged"]] == ["inputs/surface.yaml"]
    assert result["differences"][0].startswith("surface.yaml")


def test_a_scene_that_has_changed_since_is_named_as_the_reason(own_dataset, own_folder):
    shutil.rmtree(own_folder / "scene")
    write_scene(toy_street(seed=2), own_folder / "scene", {})
    load_scene.cache_clear()  # as if in another process
    result = audited(own_dataset)
    assert result["mismatches"][0]["why"] == ["scene"] and result["differences"][0].startswith("scene")


@pytest.mark.parametrize("judge", [evaluate_dataset, run_controls])
def test_a_dataset_is_not_judged_beside_another_scene_than_its_own(own_dataset, own_folder, tmp_path, judge):
    shutil.rmtree(own_folder / "scene")
    write_scene(toy_street(seed=2), own_folder / "scene", {})
    load_scene.cache_clear()
    with pytest.raises(InputError, match=r"scene .*: must be the recorded one .* holds another now"):
        judge(str(own_dataset.root), out=str(tmp_path / "out"))


def test_a_broken_scene_lets_no_clip_be_made_and_the_report_says_so_once(own_dataset, own_folder, tmp_path):
    file = own_folder / "scene" / "means.npy"
    np.save(file, np.load(file) + 1)
    load_scene.cache_clear()
    result = audited(own_dataset, share=1.0, out=str(tmp_path / "told"))
    (told,) = result["not_remade"]
    assert "must have the SHA-256 of scene.json" in told and not result["verified"] and not result["damaged"]
    assert f"none could be made: {told}" in (tmp_path / "told" / "audit.txt").read_text()


def test_without_its_scene_a_sound_dataset_is_verified_by_its_files_and_no_clip_is_made(
    own_dataset, own_folder
):
    shutil.rmtree(own_folder / "scene")
    load_scene.cache_clear()
    assert audited(own_dataset, share=0.0)["verified"]
    result = audited(own_dataset)
    assert not result["verified"] and result["intact"] == result["files"] and result["rerun"] == []
    assert [line[:24] for line in result["not_remade"]] == ["scene scene: no folder i"]


def test_a_clip_that_ends_in_an_error_leaves_the_report_of_files_and_signature(copy, monkeypatch):
    def strike(*given):
        raise RuntimeError("lightning struck")

    monkeypatch.setattr("flows.making.generate.make_clip", strike)
    result = audited(copy)
    assert result["not_remade"] == ["a clip ended in RuntimeError: lightning struck"]
    assert not result["verified"] and result["intact"] == result["files"] and result["remade"] == []


def test_no_message_names_the_folder_in_which_clips_were_made_again(copy):
    file = copy.inputs / "vehicle.yaml"
    file.write_text(file.read_text().replace("cg_height: {value: 0.55", "cg_height: {value: -1"))
    (told,) = audited(copy)["not_remade"]
    assert str(copy.inputs / "vehicle.yaml") in told and "scratch" not in told


def test_a_seed_draws_the_same_clips_again_and_without_one_nobody_knows_which(toy_dataset):
    manifest = json.loads(toy_dataset.manifest.read_bytes())

    def drawn(seed: int) -> tuple[str, ...]:
        return tuple(clip["label"] for clip in draw_clips(manifest, 0.5, seed))

    draws = {drawn(seed) for seed in range(100)}
    assert drawn(7) == drawn(7) and {len(draw) for draw in draws} == {2} and len(draws) == 12
    assert [len(draw_clips(manifest, share, 7)) for share in (0.0, 0.01, 0.26)] == [0, 1, 2]
    seeds = {audited(toy_dataset, share=0.0)["seed"] for _ in range(3)}
    assert len(seeds) == 3 and audited(toy_dataset, share=0.0, seed=7)["seed"] == 7


def test_another_catalogue_or_code_does_not_go_into_the_same_folder_and_both_values_are_told(
    own_dataset, own_folder, monkeypatch
):
    (own_folder / "camera.yaml").write_text(TOY_CAMERA.replace("{value: 80", "{value: 81"))
    monkeypatch.setattr("flows.making.plan.code_version", lambda: {"version": "9", "source_sha256": "0" * 64})
    with pytest.raises(InputError) as told:
        generate_dataset(str(own_folder / "grid.yaml"), str(own_dataset.root), runner="threads")
    text = str(told.value)
    assert "camera.yaml focal_length.value is 80 there and 81 here" in text
    assert "code version is" in text and "and 9 here" in text and "clips" not in text


def test_an_audit_left_to_itself_takes_another_number_of_workers_than_the_run_did(copy, monkeypatch):
    taken = []
    monkeypatch.setattr(
        flows.auditing.audit, "remake_and_compare", lambda *given: taken.append(given[4]) or []
    )
    audited(copy, workers=None)
    audited(copy, workers=7)
    assert taken[0] not in (None, 0, count_processors()) and taken[1] == 7
