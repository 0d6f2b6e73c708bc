"""Where a report is written: into a folder of its own, over what a report wrote and over nothing else."""

import shutil
import struct
import zlib
from base64 import b64decode

import numpy as np
import pytest

from flows.reading.report import make_report, pack_columns
from flows.store.layout import PARTIAL
from flows.store.outputs import MARKER
from tasks.errors import InputError


def test_files_that_no_report_wrote_stay_and_those_of_clips_that_went_go(toy_dataset, tmp_path):
    page = tmp_path / "page"
    make_report(str(toy_dataset.root), out=str(page), clips=["dry/flat", "dry/hump"])
    ours = {path.name for folder in ("clips", "media") for path in (page / folder).iterdir()}
    for name in ("clips/holiday.mp4", "media/wedding.mp4", "letter.txt"):
        (page / name).write_text("mine")
    (page / "media" / f"{'0' * 16}.mp4").write_text("mine, with a name like a film's")
    assert make_report(str(toy_dataset.root), out=str(page), clips=["dry/hump"])["films_made"] == 0
    left = {path.name for folder in ("clips", "media") for path in (page / folder).iterdir()}
    assert len(ours & left) == 2 and len(ours - left) == 2
    assert left - ours == {"holiday.mp4", "wedding.mp4", f"{'0' * 16}.mp4"}
    assert (page / "letter.txt").read_text() == "mine"


@pytest.mark.parametrize("theirs", ["clips/holiday.mp4", "index.html", ".musync-written"])
def test_a_folder_that_only_looks_like_a_report_is_left_alone(toy_dataset, tmp_path, theirs):
    (tmp_path / "clips").mkdir()
    (tmp_path / theirs).write_text('{"format": "musync-written/1", "files": {"clips/holiday.mp4": "audit"}}')
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    with pytest.raises(InputError, match="must be new, empty or an earlier report"):
        make_report(str(toy_dataset.root), out=str(tmp_path))
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_a_report_that_was_killed_before_its_list_was_there_is_made_again(toy_dataset, tmp_path):
    half = tmp_path / f"{MARKER}.{2**22 + 1}-7{PARTIAL}"
    half.write_text("{")
    make_report(str(toy_dataset.root), out=str(tmp_path), clips=["dry/flat"])
    assert (tmp_path / "index.html").is_file() and not half.exists()


def test_a_page_is_not_written_through_links(toy_dataset, tmp_path):
    victim, page = tmp_path / "victim", tmp_path / "page"
    victim.mkdir()
    make_report(str(toy_dataset.root), out=str(page), clips=["dry/hump"])
    shutil.rmtree(page / "media")
    (page / "media").symlink_to(victim)
    (page / "data.js").unlink()
    (page / "data.js").symlink_to(victim / "data.js")
    with pytest.raises(InputError) as told:
        make_report(str(toy_dataset.root), out=str(page))
    assert len(told.value.problems) == 2
    beside = tmp_path / "data"
    beside.symlink_to(toy_dataset.root)
    (toy_dataset.root.parent / f"{toy_dataset.root.name}-report").symlink_to(victim)
    try:
        with pytest.raises(InputError, match="is a link; name the page's folder"):
            make_report(str(toy_dataset.root))
    finally:
        (toy_dataset.root.parent / f"{toy_dataset.root.name}-report").unlink()
    assert list(victim.iterdir()) == []


def test_packed_columns_read_back_bit_for_bit():
    columns = {"x": np.array([0.1, -0.0, np.nan]), "on": np.array([True, False, True])}
    content = pack_columns(columns, ["x", "on"])
    planes = zlib.decompress(b64decode(content["packed"]))
    read = [struct.unpack("<d", planes[i : 8 * 3 : 3])[0] for i in range(3)]
    np.testing.assert_array_equal(np.array(read).view(np.uint64), columns["x"].view(np.uint64))
    assert content["columns"] == ["x", "on"] and len(planes) == 2 * 8 * 3


def test_the_page_does_not_go_among_other_files_nor_into_the_dataset(toy_dataset, tmp_path):
    (tmp_path / "letter.txt").write_text("mine")
    with pytest.raises(InputError, match="holds other files"):
        make_report(str(toy_dataset.root), out=str(tmp_path))
    with pytest.raises(InputError, match="outside the dataset"):
        make_report(str(toy_dataset.root), out=str(toy_dataset.root / "report"))
    with pytest.raises(InputError, match="clip 'moon': there is none of this name"):
        make_report(str(toy_dataset.root), clips=["moon"])
