"""A catalogue entry is found by its name or by a file, and a name never leads out of the catalogue."""

import pytest

from catalogs.entries import KINDS, entry_folder, entry_names, find_entry, load
from tasks.errors import InputError


@pytest.mark.parametrize(
    "name",
    [
        "a" * 100_000,
        "a" * 100_000 + ".yaml",
        "a\x00b",
        "a\x00b.yaml",
        "",
        ".",
        "..",
        "../vehicles/paper-reference",
        "./paper-reference",
        "/etc/passwd",
        "paper-reference\n",
        "\ud800",
        "\ud800.yaml",
    ],
)
def test_a_name_that_is_none_is_one_short_sentence_with_those_that_exist(name):
    with pytest.raises(InputError, match=r"no such vehicle; .*paper-reference") as caught:
        load("vehicle", name)
    assert len(str(caught.value)) < 500


def test_a_folder_or_pipe_that_ends_like_a_file_is_no_entry(tmp_path):
    (tmp_path / "folder.yaml").mkdir()
    with pytest.raises(InputError, match="no such vehicle"):
        find_entry("vehicle", tmp_path / "folder.yaml")


def test_a_name_is_looked_up_and_a_file_is_taken_as_it_is(tmp_path):
    file = tmp_path / "my car.yaml"
    file.write_text("{}")
    assert find_entry("vehicle", file) == file
    assert find_entry("vehicle", "bmw-m8") == entry_folder("vehicle") / "bmw-m8.yaml"


@pytest.mark.parametrize("kind", [kind for kind in KINDS if entry_folder(kind).is_dir()])
def test_every_name_of_a_kind_is_found_in_its_folder(kind):
    names = entry_names(kind)
    assert names
    assert {find_entry(kind, name).parent for name in names} == {entry_folder(kind)}
    assert all(load(kind, name) is not None for name in names)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if entry_folder(kind).is_file()])
def test_the_only_entry_of_a_kind_is_read_once_and_another_file_in_its_place_whenever_it_is_named(kind):
    assert load(kind) is load(kind)
    assert repr(load(kind, entry_folder(kind))) == repr(load(kind))  # some hold arrays
