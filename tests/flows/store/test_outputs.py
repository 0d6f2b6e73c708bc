"""A command overwrites and deletes only what it wrote itself, whatever lies in the folder."""

import json
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from flows.store.journal import append_line, read_lines
from flows.store.layout import PARTIAL
from flows.store.outputs import MARKER, Outputs, find_name_problem, read_marker
from tasks.errors import InputError


def contents(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != MARKER
    }


def write(folder: Path, command: str, *names: str, content: str = "x") -> None:
    results = Outputs(folder, command, *names)
    for name in names:
        results.write(name, content)


def test_a_command_overwrites_its_own_files_and_several_share_a_folder(tmp_path):
    for content in ("old", "new"):
        write(tmp_path / "out", "audit", "audit.json", "audit.txt", content=content)
        write(tmp_path / "out", "verify", "verify.json", content=content)
    assert contents(tmp_path / "out") == dict.fromkeys(("audit.json", "audit.txt", "verify.json"), b"new")
    assert read_marker(tmp_path / "out") == {
        "audit.json": "audit", "audit.txt": "audit", "verify.json": "verify"
    }  # fmt: skip


def test_every_file_in_the_way_is_named_at_once_and_nothing_is_written(tmp_path):
    (tmp_path / "a.json").write_text("mine")
    write(tmp_path, "verify", "b.json")
    (tmp_path / "c.json").mkdir()
    (tmp_path / "clips").symlink_to(tmp_path)
    before = contents(tmp_path)
    with pytest.raises(InputError) as told:
        Outputs(tmp_path, "audit", "a.json", "b.json", "c.json", "clips/d.json", "free.json")
    assert [str(tmp_path / name) in problem for name, problem in zip(
        ("a.json", "b.json", "c.json", "clips"), told.value.problems, strict=True
    )] == [True] * 4  # fmt: skip
    assert "is not a file that musync audit wrote" in told.value.problems[0]
    assert "move it away or name another folder" in told.value.problems[0]
    assert contents(tmp_path) == before


def test_a_file_that_appears_during_the_run_is_kept(tmp_path):
    results = Outputs(tmp_path / "out", "audit", "audit.json")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "audit.json").write_text("mine")
    with pytest.raises(InputError, match="is not a file that musync audit wrote"):
        results.write("audit.json", "theirs")
    assert contents(tmp_path / "out") == {"audit.json": b"mine"}


@pytest.mark.parametrize("name", ["link.json", "sub/x.json"])
def test_no_link_is_followed_whatever_the_marker_says(tmp_path, name):
    victim, out = tmp_path / "victim", tmp_path / "out"
    for folder in (victim, out):
        folder.mkdir()
    (victim / "x.json").write_text("precious")
    (out / "link.json").symlink_to(victim / "x.json")
    (out / "sub").symlink_to(victim)
    (out / MARKER).write_text(json.dumps({"format": "musync-written/1", "files": {name: "audit"}}))
    with pytest.raises(InputError, match="no link"):
        write(out, "audit", name)
    earlier = Outputs(out, "audit", "other.json")
    earlier.write("other.json", "x")
    earlier.remove_others(lambda name: True)
    assert contents(victim) == {"x.json": b"precious"}
    assert (out / "link.json").is_symlink() and (out / "sub").is_symlink()


def test_a_name_that_is_hard_linked_elsewhere_leaves_the_other_name_its_content(tmp_path):
    write(tmp_path / "out", "audit", "audit.json", content="old")
    os.link(tmp_path / "out" / "audit.json", tmp_path / "copy")
    write(tmp_path / "out", "audit", "audit.json", content="new")
    assert (tmp_path / "copy").read_text() == "old"


@pytest.mark.parametrize(
    "marker",
    [
        "", "[]", "no json", '{"format": "musync-written/1"}', '{"format": "musync-written/9", "files": {}}',
        "[" * 10**5,
        '{"format": "musync-written/1", "files": {"../x.json": "audit"}}',
        '{"format": "musync-written/1", "files": {"x.json": 1}}',
        '{"format": "musync-written/1", "files": ["x.json"]}',
    ],
)  # fmt: skip
def test_a_marker_that_is_none_of_ours_is_refused(tmp_path, marker):
    (tmp_path / MARKER).write_text(marker)
    with pytest.raises(InputError, match="must be muSync's list"):
        Outputs(tmp_path, "audit", "audit.json")


@pytest.mark.parametrize("kind", ["link", "pipe", "folder"])
def test_a_marker_that_is_no_file_is_refused(tmp_path, kind):
    place = tmp_path / "out" / MARKER
    place.parent.mkdir()
    if kind == "link":
        (tmp_path / "real").write_text('{"format": "musync-written/1", "files": {"audit.json": "audit"}}')
        place.symlink_to(tmp_path / "real")
    elif kind == "pipe":
        os.mkfifo(place)
    else:
        place.mkdir()
    with pytest.raises(InputError, match="must be muSync's list"):
        Outputs(place.parent, "audit", "audit.json")


@pytest.mark.parametrize(
    "name",
    [
        "",
        ".",
        "..",
        "../x",
        "/x",
        "a/../b",
        "a\0b",
        "\ud800",
        "x" * 300,
    ],
)
def test_a_name_stays_inside_the_folder(tmp_path, name):
    assert find_name_problem(name) is not None
    with pytest.raises(InputError):
        Outputs(tmp_path, "calibrate", name)


def test_a_folder_that_cannot_be_used_is_told_before_the_work(tmp_path):
    (tmp_path / "file").write_text("mine")
    (tmp_path / "dangling").symlink_to(tmp_path / "nowhere")
    for out in ("file", "file/below", "dangling"):
        with pytest.raises(InputError, match="must be a folder"):
            Outputs(tmp_path / out, "audit", "audit.json")


@pytest.mark.parametrize("record", ["plan.json", "manifest.json"])
@pytest.mark.parametrize("place", [".", "results/new", "../link/results"])
def test_a_dataset_keeps_only_the_files_that_it_records(tmp_path, place, record):
    dataset = tmp_path / "dataset"
    (dataset / "inputs").mkdir(parents=True)
    (dataset / record).write_text("{}")
    (tmp_path / "link").symlink_to(dataset)
    with pytest.raises(
        InputError, match="must lie outside the dataset dataset, whose files are all recorded"
    ):
        Outputs(dataset / place, "diff", "diff.json")
    assert contents(dataset) == {record: b"{}"}
    write(tmp_path / "beside", "diff", "diff.json")


def test_the_marker_lists_a_file_before_it_is_there(tmp_path, monkeypatch):
    def full(path: Path, content: bytes) -> None:
        raise OSError(28, "No space left on device")

    results = Outputs(tmp_path, "audit", "audit.json", "audit.txt")
    results.path("audit.txt")
    monkeypatch.setattr("flows.store.outputs.write_atomically", full)
    with pytest.raises(OSError, match="No space"):
        results.write("audit.json", "x")
    monkeypatch.undo()
    assert read_marker(tmp_path) == {"audit.json": "audit", "audit.txt": "audit"}
    write(tmp_path, "audit", "audit.json")


def test_only_earlier_files_of_the_command_and_of_the_form_go(tmp_path):
    write(tmp_path, "report", "index.html", "clips/1.js", "clips/2.js", "notes.txt")
    write(tmp_path, "preview", "clips/film.js")
    (tmp_path / "clips" / "holiday.mp4").write_text("mine")
    results = Outputs(tmp_path, "report", "index.html", "clips/2.js")
    results.write("index.html", "x")
    results.remove_others(lambda name: name.startswith("clips/"))
    assert set(contents(tmp_path)) == {
        "index.html", "clips/2.js", "clips/film.js", "clips/holiday.mp4", "notes.txt"
    }  # fmt: skip
    assert "clips/1.js" not in read_marker(tmp_path)


def test_what_a_killed_command_left_half_written_goes_and_nothing_else(tmp_path):
    write(tmp_path, "report", "index.html", "clips/1.js")
    left = [f"index.html.17{PARTIAL}", f"clips/1.js.17{PARTIAL}"]
    kept = [f"clips/mine.17{PARTIAL}", "clips/1.js.bak"]
    for name in (*left, *kept):
        (tmp_path / name).write_text("x")
    (tmp_path / "clips" / f"1.js.18{PARTIAL}").symlink_to(tmp_path / "index.html")
    with Outputs(tmp_path, "report", "index.html").alone():
        pass
    assert set(contents(tmp_path)) == {"index.html", "clips/1.js", f"clips/1.js.18{PARTIAL}", *kept}


def test_two_that_must_be_alone_do_not_meet(tmp_path):
    first, second = (Outputs(tmp_path, "report", "index.html") for _ in range(2))
    with (
        first.alone(),
        pytest.raises(InputError, match="another musync command is writing there"),
        second.alone(),
    ):
        pytest.fail("both were let in")
    with second.alone():
        second.write("index.html", "x")


def test_many_commands_at_once_lose_no_name(tmp_path):
    names = [f"{k}.json" for k in range(20)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda name: write(tmp_path, "audit", name), names))
    assert set(read_marker(tmp_path)) == set(names)


def test_without_a_folder_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    results = Outputs(None, "audit", "audit.json")
    results.write_json("audit.json", {})
    results.remove_others(lambda name: True)
    with results.alone():
        assert list(tmp_path.iterdir()) == []


def test_a_journal_keeps_what_it_had_and_skips_what_a_kill_has_cut(tmp_path):
    path = tmp_path / "log.jsonl"
    assert read_lines(path, {"a"}) == []
    append_line(path, {"a": 1})
    with path.open("a") as stream:
        stream.write('{"a": 2, "b')
    assert read_lines(path, {"a"}) == [{"a": 1}]
    append_line(path, {"a": 3})
    assert read_lines(path, {"a"}) == [{"a": 1}, {"a": 3}]
    assert path.read_text().startswith('{"a": 1}\n{"a": 2, "b')


@pytest.mark.parametrize("line", ["thesis", "[1]", '{"b": 1}', '{"a": 1', "\xff"])
def test_a_journal_of_something_else_is_refused_with_its_line(tmp_path, line):
    path = tmp_path / "log.jsonl"
    path.write_text('{"a": 1}\n' + line + "\n", encoding="latin-1")
    with pytest.raises(InputError, match="line 2 must be a JSON object with a"):
        read_lines(path, {"a"})


def test_a_journal_is_not_written_through_a_link(tmp_path):
    (tmp_path / ".bashrc").write_text("")
    (tmp_path / "log.jsonl").symlink_to(tmp_path / ".bashrc")
    for act in (lambda path: append_line(path, {"a": 1}), lambda path: read_lines(path, {"a"})):
        with pytest.raises(InputError, match="no link"):
            act(tmp_path / "log.jsonl")
    assert (tmp_path / ".bashrc").read_text() == ""
