"""A reader that hangs, crashes, grows or accepts what it must not is counted, and the inputs after it are read."""

import ctypes
import os
import signal
import time
from pathlib import Path

import pytest

from studies.fuzzing import desk, watched
from studies.fuzzing.desk import write_documents
from studies.fuzzing.parser import Parser
from studies.fuzzing.rules import FINITE
from studies.fuzzing.sound import write_texts
from studies.fuzzing.watched import read_watched
from tasks.errors import InputError

kept = []


def refuse(folder: Path) -> None:
    raise InputError("it is refused")


def work_for_ever(folder: Path) -> None:
    while True:
        pass


def wait_for_ever(folder: Path) -> None:
    time.sleep(1_000)


def crash(folder: Path) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def grow(folder: Path) -> None:
    watched.LARGEST_BYTES = watched.read_peak() + 2**26  # in the process of its own that reads
    kept.append(ctypes.create_string_buffer(b"x" * 2**27))


def divide(folder: Path) -> None:
    1 / 0  # noqa: B018


def flood(folder: Path) -> None:
    raise InputError("x" * 100_000)


@pytest.mark.parametrize(
    ("read", "outcome", "words"),
    [
        (refuse, "refused", "it is refused"),
        (lambda folder: None, "silent", "accepted although"),
        (work_for_ever, "hang", "over 0.2 s"),
        (wait_for_ever, "hang", "over 0.2 s"),
        (crash, "traceback", "the process ended with -9"),
        (grow, "memory", "MiB"),
        (divide, "traceback", "ZeroDivisionError"),
        (flood, "traceback", "sentences of 100000 characters"),
    ],
)
def test_what_becomes_of_an_input_is_counted(tmp_path, monkeypatch, read, outcome, words):
    changes = iter([False])

    def read_changed(folder: Path) -> None:
        # the sound document, which each process reads first, is accepted
        if next(changes, True):
            read(folder)

    parser = Parser(name="p", write=write_texts({"a.yaml": "a: 1"}), read=read_changed, rules=(FINITE,))
    monkeypatch.setattr(desk, "BY_NAME", {"p": parser})
    monkeypatch.setattr(watched, "START", "fork")
    if outcome == "hang":  # on a busy machine what ends may take longer
        monkeypatch.setattr(watched, "LONGEST_S", 0.2)
        monkeypatch.setattr(watched, "LONGEST_WAIT_S", 2.0)
    monkeypatch.setattr(watched, "LOOKED_AT_S", 0.1)
    monkeypatch.setattr(watched, "LARGEST_BYTES", 2**50)  # a fork of a large process is no finding
    monkeypatch.setattr("studies.fuzzing.inputs.KNOWINGLY", 1.0)
    (tmp_path / "p" / "0").mkdir(parents=True)
    (tmp_path / "p" / "0" / "a.yaml").write_text("a: 1")
    readings = list(read_watched([("p", range(3))], tmp_path, seed=1, workers=1))
    assert sorted(reading.number for reading in readings) == [0, 1, 2]
    found = [reading for reading in readings if reading.outcome == outcome]
    assert found and words in found[0].detail


def test_a_sound_document_that_is_refused_ends_the_study(tmp_path):
    parser = Parser(name="p", write=write_texts({"a.yaml": "a: 1"}), read=refuse)
    with pytest.raises(InputError):
        write_documents([parser], tmp_path)
