"""Text of users and datasets reaches the terminal as text."""

import re

import pytest

from flows.printing import print_json, print_result
from flows.running.progress import progress_bar
from flows.running.terminal import escape_controls, escape_lines, open_console

HOSTILE = [
    "[/red]", "[bold]x[/bold]", "a[b]c", ":smile:", "\x1b[2J\x1b]0;title\x07", "x\rforged", "\u202egnp.exe", "\x9b31m",
    "\ud800", "$(reboot)", "{task.description}", "line\nverified: True",
]  # fmt: skip


@pytest.mark.parametrize("label", HOSTILE)
def test_a_label_is_printed_as_it_is_with_its_control_characters_written_out(capsys, label):
    print_result({"clips": [{"label": label}], "first": label, "all": [label]})
    printed = capsys.readouterr().out
    assert not re.search("[\x00-\x09\x0b-\x1f\x7f-\x9f\u202e\ud800]", printed)
    lines = printed.splitlines()
    assert f"first: {escape_controls(label)}" in lines and f"all: {escape_controls(label)}" in lines
    assert "verified: True" not in lines
    if escape_controls(label) == label:
        assert label in printed.split("first:")[0]


@pytest.mark.parametrize("on_terminal", [False, True])
@pytest.mark.parametrize("label", HOSTILE)
def test_a_label_in_the_progress_is_text(capsys, monkeypatch, label, on_terminal):
    monkeypatch.setattr("sys.stderr.isatty", lambda: on_terminal, raising=False)
    monkeypatch.setenv("COLUMNS", "200")
    with progress_bar("clips", 1) as advance:
        advance(label)
    printed = capsys.readouterr().err
    assert escape_controls(label) in printed
    assert "\x1b[2J" not in printed and "\x07" not in printed and "\u202e" not in printed


def test_json_is_plain_ascii(capsys):
    print_json({"label": "".join(HOSTILE)})
    assert capsys.readouterr().out.isascii()


def test_each_sentence_of_a_list_has_a_line_of_its_own(capsys):
    print_result({"reasons": ["a, b", "c\x1b"], "made": ["dry", "snow"]})
    assert capsys.readouterr().out == "reasons:\n  - a, b\n  - c\\x1b\nmade: dry, snow\n"


def test_only_the_line_feeds_of_several_lines_stay():
    assert escape_controls("a\n\x1b") == r"a\n\x1b"
    assert escape_lines("a\n\x1b\tb") == "a\n" + r"\x1b\tb"
    assert escape_controls("Schnee, 雪, é") == "Schnee, 雪, é"


def test_a_table_too_wide_for_the_terminal_lies_on_its_side_and_cuts_no_number(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    wide = [
        {f"figure_{k}_of_a_drive": 1234.5 + k for k in range(12)} | {"drive": name} for name in ("one", "two")
    ]
    print_result({"drives": wide, "small": [{"drive": "one", "events": 16}]})
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    for k in range(12):
        row = next(line for line in lines if f"figure_{k}_of_a_drive" in line)
        assert row.count(f"{1234.5 + k:.5g}") == 2
    assert any("drive" in line and "events" in line for line in lines), "a small one stands upright"


def test_a_table_of_many_rows_and_columns_comes_in_blocks_that_cut_no_value(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    rows = [
        {"clip": f"clip-{n}"} | {f"column_{k}": 100000 + 100 * n + k for k in range(30)} for n in range(40)
    ]
    print_result({"rows": rows})
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    printed = " ".join(lines)
    assert all(f" {value} " in printed for row in rows for value in row.values())
    blocks = [line for line in lines if "column_" in line]
    assert len(blocks) > 3 and all(" clip " in line for line in blocks)


def test_a_long_text_is_folded_in_its_place(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "60")
    print_result({"rows": [{"label": "dry", "file": "x" * 100, "count": 7} for _ in range(4)]})
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 60 and "".join(lines).count("x") == 400
    assert (
        sum("label" in line for line in lines) == 1
        and sum("dry" in line and "7" in line for line in lines) == 4
    )


def test_a_reader_that_leaves_ends_no_run(monkeypatch):
    console = open_console()
    monkeypatch.setattr("flows.running.terminal._silence_stream", lambda stream: None)
    console.on_broken_pipe()
