"""Mutated inputs for every parser: refused in a sentence, or sound; and each earlier finding stays found."""

import dataclasses
import io
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from studies.fuzzing import trees
from studies.fuzzing.__main__ import plan_inputs
from studies.fuzzing.desk import FINDINGS, Desk, lay_out, read_input, write_documents
from studies.fuzzing.inputs import Documents, Input, make_input
from studies.fuzzing.parsers import BY_NAME, PARSERS
from tests.hostile.cases import COLUMNS, PLACES, TEXTS, WORDS

OF_TEXT = [parser.name for parser in PARSERS if parser.name not in {"manifest", "telemetry", "planned grid"}]
"""Parsers of which some file is YAML or JSON; those left out read one that another parser reads."""


@pytest.fixture(scope="module")
def shelf(tmp_path_factory) -> Path:
    """The sound documents of every parser, all of which their loaders take."""
    folder = tmp_path_factory.mktemp("sound")
    write_documents(PARSERS, folder)
    return folder


@pytest.fixture(scope="module")
def documents(shelf) -> dict[str, Documents]:
    return {parser.name: Documents(parser, shelf / parser.name) for parser in PARSERS}


def outcome(documents: Documents, file: str, content: bytes, folder: Path) -> tuple[str, str]:
    """Outcome of a document with this content in one file; its seals are made again where that can be."""
    document, _, name = file.partition("/")
    whole = documents.files[document]
    changed = {name: content}
    if documents.parser.reseal is not None:
        try:
            sealed = documents.parser.reseal(whole | changed, name)
            changed = {name: data for name, data in sealed.items() if whole[name] != data}
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
            pass
    lay_out(whole, folder / document)
    made = Input(document=document, changed=changed, what="a case", broken="the case must be refused")
    return read_input(documents, made, folder / document)


def test_forty_inputs_are_refused_in_a_sentence_or_sound(shelf, tmp_path):
    """``make study-fuzz`` reads many thousands, in processes that are watched."""
    plan, desk = plan_inputs(list(PARSERS), 40), Desk(shelf, tmp_path)
    readings = [
        (name, number, *desk.read(name, 12, number)[1:]) for name, numbers in plan for number in numbers
    ]
    assert len(readings) >= 40 and {name for name, *_ in readings} == set(BY_NAME)
    told = [reading for reading in readings if reading[2] in FINDINGS]
    assert told == [], "python -m studies.fuzzing --seed 12 --parser P --input N makes one of them again"


def test_an_input_can_be_made_again_alone(documents):
    for name, numbers in plan_inputs(list(PARSERS), 150):
        first = [make_input(documents[name], 12, number) for number in numbers]
        again = make_input(documents[name], 12, numbers[-1])
        assert dataclasses.asdict(again) == dataclasses.asdict(first[-1]), name


@pytest.mark.parametrize("name", OF_TEXT)
def test_text_that_is_no_document_is_refused_by_every_reader_of_text(documents, name, tmp_path):
    sound = documents[name]
    found = {}
    for document, files in sound.files.items():
        texts = [file for file in files if sound.parser.mutates(file) and file.endswith((".yaml", ".json"))]
        for file in texts[:1]:
            for what, content in TEXTS.items():
                result = outcome(sound, f"{document}/{file}", content, tmp_path)
                if result[0] != "refused":
                    found[what] = result
        break
    assert found == {}


@pytest.mark.parametrize(("name", "file", "path", "value"), PLACES)
def test_a_value_that_broke_a_reader_is_refused(documents, name, file, path, value, tmp_path):
    document, _, inner = file.partition("/")
    tree = documents[name].tree(document, inner)
    assert path in [place for place, _ in trees.list_places(tree)], "the sound document has no such place"
    text = trees.format_tree(trees.change_value(tree, path, lambda _: value), file.endswith(".yaml"))
    assert outcome(documents[name], file, text.encode(), tmp_path)[0] == "refused"


@pytest.mark.parametrize(("name", "file", "old", "new"), WORDS)
def test_bytes_that_broke_a_reader_are_refused(documents, name, file, old, new, tmp_path):
    document, _, inner = file.partition("/")
    content = documents[name].files[document][inner]
    assert old in content, "the sound document has no such bytes"
    assert outcome(documents[name], file, content.replace(old, new, 1), tmp_path)[0] == "refused"


@pytest.mark.parametrize(("name", "file", "column", "value"), COLUMNS)
def test_a_column_that_broke_a_reader_is_refused(documents, name, file, column, value, tmp_path):
    document, _, inner = file.partition("/")
    table = pq.read_table(pa.BufferReader(documents[name].files[document][inner]))
    place = table.column_names.index(column)
    if value is None:
        table = table.remove_column(place)
    else:
        table = table.set_column(place, column, pa.concat_arrays([value] * table.num_rows))
    stored = io.BytesIO()
    pq.write_table(table, stored)
    assert outcome(documents[name], file, stored.getvalue(), tmp_path)[0] == "refused"
