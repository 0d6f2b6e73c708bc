"""The door for YAML and JSON: what passes is plain and bounded, what does not is refused with a sentence in time."""

import json
import os
import time
import tracemalloc
from pathlib import Path

import pytest
import yaml

from catalogs import documents
from catalogs.documents import parse_json, parse_yaml, parse_yaml_value, read_content, read_json_document
from catalogs.yaml_text import DEEPEST, LARGEST_INTEGER
from tasks.errors import InputError

CATALOGS = Path(documents.__file__).parent


def problems_of(parse, content: bytes) -> tuple[str, ...]:
    with pytest.raises(InputError) as caught:
        parse(content, "here", "note")
    assert all(problem.startswith("here: a note must ") for problem in caught.value.problems)
    return caught.value.problems


def nested_aliases(levels: int) -> bytes:
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, levels)]
    return "\n".join(lines).encode()


@pytest.mark.parametrize("path", sorted(CATALOGS.rglob("*.yaml")), ids=lambda path: path.stem)
def test_what_ships_is_read_as_yamls_own_loader_reads_it(path):
    assert parse_yaml_value(path.read_bytes(), path, "file") == yaml.safe_load(path.read_text())


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"a: \xff", "be UTF-8 text; line 1 is not"),
        (b"a: [", "be valid YAML; line 2: while parsing a flow node"),
        (b"a: 1\n---\nb: 1", "single document"),
        (b"", "be a table of keys and values; it is None"),
        (b"[1, 2]", "be a table of keys and values; it is [1, 2]"),
        (b"a: 1\na: 2", "have distinct keys in a table; 'a' stands there twice (line 2)"),
        (b"1: a", "have text as keys; one is 1: put it in quotes (line 1)"),
        (b"on: a", "have text as keys; one is on"),
        (b"? [1]\n: a", "have text as keys; one is a table or list"),
        (b"a: !!python/object/apply:os.system [ls]", "hold plain values; one has the tag"),
        (b"a: !!bool maybe", "have values that keep to their tag; 'maybe' is no bool"),
        (b"a: 0x_", "'0x_' is no int"),
        (b"a: .nan", "have finite numbers; one is .nan (line 1)"),
        (b"a: 9007199254740993", "have integers of at most 2^53"),
        (b"a: " + b"1" * 5000, "have numbers of at most 400 characters; one has 5000"),
        (b"a: &a [*a]", "not hold itself; line 1"),
        (b"a: *b", "undefined alias"),
        (nested_aliases(9), "with its aliases written out"),
        (b"[" * 100_000, f"have at most {DEEPEST} tables and lists inside each other"),
        (b"? " * 100_000, f"have at most {DEEPEST} tables"),
        (b"[" + b"1," * 600_000 + b"1]", "have at most 500000 keys and values"),
        (b"#" * (documents.LARGEST_YAML + 1), "have at most 8388608 bytes; it has 8388609"),
    ],
)
def test_faulty_yaml_is_one_sentence_in_time(content, words):
    begun = time.process_time()
    (problem,) = problems_of(parse_yaml, content)
    assert words in problem
    assert len(problem) < 300 and problem.isprintable()
    assert time.process_time() - begun < 5


@pytest.mark.parametrize("number", ["0420", "-0_7", "7:00", "12:30:45.5", "+190:20:30"])
def test_a_number_that_yaml_reads_to_another_base_is_refused(number):
    """0420 would be 272, and 7:00 would be 420, without a word."""
    with pytest.raises(InputError, match=r"must have plain decimal numbers; YAML takes .* \(line 2\)"):
        parse_yaml(f"b: 1\na: {number}".encode(), "a file", "document")
    assert parse_yaml(f"a: '{number}'".encode(), "a file", "document") == {"a": number}


@pytest.mark.parametrize(
    ("text", "value"), [("0", 0), ("0.5", 0.5), ("-0.0", 0.0), ("1_000", 1000), ("0x10", 16)]
)
def test_other_numbers_are_what_they_look_like(text, value):
    assert parse_yaml(f"a: {text}".encode(), "a file", "document") == {"a": value}


def test_all_faults_of_yaml_are_told_at_once_with_their_lines():
    problems = problems_of(parse_yaml, b"a: 1\na: 2\nb: {c: 1, c: 2, 3: 4}\nd: .inf\ne: !!omap []\n")
    assert [problem.rpartition(" (line ")[2] for problem in problems] == ["2)", "3)", "3)", "4)", "5)"]


def test_anchors_and_merges_in_their_usual_use_and_dates_as_text_are_fine():
    text = b"a: &a {x: 1, y: 2}\nb: {<<: *a, y: 3}\nc: [*a, *a]\nday: 2024-05-01\nodd: 2024-13-45\n"
    assert parse_yaml(text, "here", "note") == {
        "a": {"x": 1, "y": 2}, "b": {"x": 1, "y": 3}, "c": [{"x": 1, "y": 2}] * 2,
        "day": "2024-05-01", "odd": "2024-13-45",
    }  # fmt: skip


def test_a_reader_that_refuses_nan_itself_gets_it():
    value = parse_yaml(b"a: .nan", "here", "note", finite=False)["a"]
    assert value != value


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b'"\xff"', "be UTF-8 text"),
        (b"[1,]", "be valid JSON"),
        (b"", "be valid JSON"),
        (b"[" * 100_000, f"have at most {DEEPEST} tables and lists inside each other; it has 100000"),
        (b'{"a":' * 100_000, f"have at most {DEEPEST} tables"),
        (b'["\\\\", ' + b"[" * 100, f"have at most {DEEPEST} tables"),
        (b'{"a": 1, "b": {"c": 1, "c": 2}}', "have distinct keys in a table; 'c' stands there twice"),
        (b"[NaN]", "have finite numbers; one is NaN"),
        (b"[-Infinity]", "have finite numbers"),
        (b"[1e999]", "have finite numbers"),
        (b"[9007199254740993]", "have integers of at most 2^53"),
        (b"[" + b"9" * 10_000 + b"]", "have integers of at most 2^53"),
        (b'["\\ud800"]', "half of a surrogate pair"),
    ],
)
def test_faulty_json_is_one_sentence(content, words):
    (problem,) = problems_of(parse_json, content)
    assert words in problem and len(problem) < 300


@pytest.mark.parametrize("block", [1, 2, 3, 7, 2**18])
def test_brackets_count_alike_in_blocks_of_any_length(monkeypatch, block):
    monkeypatch.setattr(documents, "_BLOCK", block)
    sound = b'{"]]": ["[[{", {"a": []}], "\\"[[": [[]]}' + b" " * 9
    parse_json(sound, "here", "note")
    deep = b"[" * (DEEPEST - 4) + sound + b"]" * (DEEPEST - 4)
    parse_json(deep, "here", "note")
    (problem,) = problems_of(parse_json, b"[" + deep + b"]")
    assert problem.endswith(f"it has {DEEPEST + 1}")


def test_a_large_document_is_refused_in_a_few_times_its_own_memory():
    content = b'{"a": ["b", "c"], "d": {}}\n' * 100_000
    tracemalloc.start()
    problems_of(parse_json, content)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 3 * len(content) + 2**23


def test_all_faults_of_json_are_told_at_once():
    assert (
        len(problems_of(parse_json, b'{"a": NaN, "a": 1e999, "b": 1e20, "c": [12345678901234567890]}')) == 4
    )


def test_sound_json_is_what_jsons_own_reader_gives():
    text = '{"a": [1, 2.5, -3e2, "x]}[{\\"", null, true], "b": {"\\ud83d\\ude97": 9007199254740992}}'
    assert parse_json(text.encode(), "here", "note") == json.loads(text)


def test_a_loggers_nanoseconds_pass_where_they_become_floats():
    assert parse_json(b"[1700000000000000000]", "here", "log", large_integers=True) == [17 * 10**17]
    with pytest.raises(InputError, match=r"2\^63"):
        parse_json(b"[99999999999999999999]", "here", "log", large_integers=True)
    assert LARGEST_INTEGER < 17 * 10**17


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("missing", "no such file"),
        ("folder", "a note must be"),
        ("pipe", "must be a regular file"),
        ("a" * 100_000, "File name too long"),
        ("a\x00b", "must have a proper file name"),
        ("a\ud800", "a note must"),
        ("looped", "must be readable"),
    ],
)
def test_a_file_that_cannot_be_read_is_one_short_sentence(tmp_path, name, words):
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "looped").symlink_to(tmp_path / "looped")
    with pytest.raises(InputError, match=words) as caught:
        read_json_document(tmp_path / name, "note")
    (problem,) = caught.value.problems
    assert len(problem) < 400


def test_a_file_is_not_read_further_than_it_may_be_long(tmp_path):
    (tmp_path / "large.yaml").write_text("a: 12345678")
    with pytest.raises(InputError, match="at most 10 bytes; it has 11"):
        read_content(tmp_path / "large.yaml", "note", 10)
