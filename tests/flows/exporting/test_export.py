"""``musync export``: what it refuses, and that a folder is there whole or not at all."""

import json
import sys
import tarfile
from types import ModuleType

import pytest

from catalogs.entries import load
from flows.exporting import export as module
from flows.exporting.camera import describe_camera
from flows.exporting.export import export_dataset, import_writer
from flows.exporting.formats import FORMAT_NAMES, FORMATS
from manifests.provenance import SOURCE_ROOT
from tasks.errors import InputError
from tests.flows.exporting.conftest import BRAKING, HUMP
from tests.flows.shell import run_command


def test_an_unknown_format_names_those_that_come_near(toy_dataset, monkeypatch, capsys):
    assert run_command(monkeypatch, "export", str(toy_dataset.root), "--to", "webdatset") == 2
    assert "near it: webdataset" in capsys.readouterr().err


@pytest.mark.parametrize("name", FORMAT_NAMES)
def test_every_format_of_the_table_has_its_writer(name, monkeypatch):
    monkeypatch.setattr(module, "find_spec", lambda name: True)
    assert callable(import_writer(module.find_format(name)))


def test_a_package_that_is_missing_is_named_with_how_to_install_it(toy_dataset, monkeypatch):
    monkeypatch.setattr(module, "find_spec", lambda name: None)
    for row in FORMATS:
        if row.package:
            with pytest.raises(InputError, match=rf"{row.package}.*pip install 'musync-gs\[export\]'"):
                export_dataset(str(toy_dataset.root), row.name)


def test_a_folder_that_holds_something_and_one_inside_the_dataset_are_refused(toy_dataset, tmp_path):
    (tmp_path / "thesis.txt").write_text("precious")
    (tmp_path / "link").symlink_to(tmp_path / "elsewhere")
    for out, rule in (
        (tmp_path, "must be new or an empty folder"),
        (tmp_path / "thesis.txt", "must be new or an empty folder"),
        (tmp_path / "link", "must be new or an empty folder"),
        (toy_dataset.root / "web", "must lie outside the dataset"),
    ):
        with pytest.raises(InputError, match=rule):
            export_dataset(str(toy_dataset.root), "webdataset", out=str(out), clips=[BRAKING])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link", "thesis.txt"]


def test_an_empty_folder_is_filled_and_a_dataset_without_frames_gets_its_telemetry(
    toy_dataset, tmp_path, monkeypatch
):
    (tmp_path / "out").mkdir()
    told = export_dataset(str(toy_dataset.root), "tum", out=str(tmp_path / "out"), clips=[BRAKING])
    assert told["files"] == 2 == len(list((tmp_path / "out").iterdir()))
    read = module.read_manifest
    monkeypatch.setattr(
        module,
        "read_manifest",
        lambda layout: {**(m := read(layout)), "grid": m["grid"] | {"pictures": False}},
    )
    with pytest.raises(InputError, match=r"needs frames; .* suits mcap, rerun"):
        export_dataset(str(toy_dataset.root), "coco", out=str(tmp_path / "other"), clips=[BRAKING])


def test_the_documents_have_a_row_for_every_format():
    text = (SOURCE_ROOT / "docs/how-to/export-a-dataset.md").read_text()
    assert [name for name in FORMAT_NAMES if text.count(f"\n| `{name}` |") != 2] == []


def test_a_writer_that_fails_leaves_nothing_behind(toy_dataset, tmp_path, monkeypatch):
    def write_half(dataset, folder):
        (folder / "half.tar").write_text("half")
        raise OSError("no space left")

    broken = ModuleType("flows.exporting.webdataset")
    broken.write_webdataset = write_half
    monkeypatch.setitem(sys.modules, "flows.exporting.webdataset", broken)
    with pytest.raises(OSError, match="no space"):
        export_dataset(str(toy_dataset.root), "webdataset", out=str(tmp_path / "web"), clips=[BRAKING])
    assert not list(tmp_path.iterdir())


def test_clips_in_quarantine_are_left_out_and_named_unless_asked_for(toy_dataset, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "is_quarantined", lambda row: row["label"] != HUMP)
    told = export_dataset(str(toy_dataset.root), "webdataset", out=str(tmp_path / "web"))
    assert told["clips"] == 1
    assert told["left_out"] == [BRAKING, "dry/hump", "snow-3/flat"]
    monkeypatch.setattr(module, "is_quarantined", lambda row: True)
    with pytest.raises(InputError, match="every clip is in quarantine"):
        export_dataset(str(toy_dataset.root), "webdataset", out=str(tmp_path / "other"))
    # copies of the tables, which say of each clip whether it is in quarantine
    for name in ("croissant", "ro-crate"):
        told = export_dataset(str(toy_dataset.root), name, out=str(tmp_path / name))
        assert (told["clips"], told["left_out"]) == (4, [])


def test_a_clip_that_does_not_exist_names_those_that_come_near(toy_dataset):
    with pytest.raises(InputError, match="clip 'dry/flt': there is none of this name; near it: dry/flat"):
        export_dataset(str(toy_dataset.root), "tum", clips=["dry/flt"])


def test_the_card_names_run_units_camera_and_clips(export, toy_dataset):
    card = json.loads((export("webdataset") / "musync-export.json").read_text())
    manifest = json.loads(toy_dataset.manifest.read_text())
    assert (card["run_id"], card["seal"]) == (manifest["run_id"], manifest["seal"])
    assert card["columns"]["pitch"]["unit"] == "rad"
    assert [clip["label"] for clip in card["clips"]] == [BRAKING, HUMP]
    assert card["camera"]["K"][0] == [80.0, 0.0, 48.0]


def test_a_camera_is_described_with_its_lens_and_its_shutter():
    told = describe_camera(load("camera", "dashcam-480x320-rolling"))
    assert json.loads(json.dumps(told)) == told
    assert (told["width"], told["height"], told["K"][0]) == (480, 320, [400.0, 0.0, 240.0])
    # KITTI, D_02 of 2011-09-26, in OpenCV's order k1, k2, p1, p2, k3
    assert told["distortion"] == [-3.691481e-01, 1.968681e-01, 1.353473e-03, 5.677587e-04, -6.770705e-02]
    assert (told["line_delay_s"], told["motion_blur"], told["exposure_s"]) == (6.94e-5, True, 0.008)


def test_card_samples_and_annotations_describe_the_same_camera(export, toy_dataset):
    told = describe_camera(load("camera", toy_dataset.inputs / "camera.yaml"))
    assert json.loads((export("webdataset") / "musync-export.json").read_text())["camera"] == told
    with tarfile.open(export("webdataset") / "clip-00000.tar") as shard:
        sample = next(name for name in shard.getnames() if name.endswith(".json"))
        assert json.load(shard.extractfile(sample))["camera"] == told
    assert json.loads((export("coco") / "annotations.json").read_text())["camera"] == told
