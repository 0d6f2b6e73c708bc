"""Wrong words of a benchmark's command line: one sentence and exit code 2, before anything is measured."""

import sys

import pytest

from benchmarks import pipeline
from flows.cli import run_to_end
from studies import severity
from studies.peers import queries


@pytest.mark.parametrize(
    ("benchmark", "word", "sentence"),
    [
        (queries, "many", "invalid int value: 'many'"),
        (queries, "0", "musync: clips must be 1 or more; it is 0"),
        (severity, "nowhere", "musync: severity: scene nowhere: no such scene"),
        (pipeline, "nowhere", "musync: nowhere: no such grid"),
    ],
)
def test_a_wrong_word_is_one_sentence(monkeypatch, capsys, benchmark, word, sentence):
    monkeypatch.setattr(sys, "argv", ["benchmark", word])
    with pytest.raises(SystemExit) as end:
        run_to_end(benchmark.run_benchmark)
    message = capsys.readouterr().err
    assert end.value.code == 2
    assert sentence in message and "Traceback" not in message
