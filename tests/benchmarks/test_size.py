"""The counts of `make size` on texts and modules whose counts are known."""

import ast

import pytest

from benchmarks.size import count_constants, list_imports, list_sentences, measure_documents


@pytest.mark.parametrize(
    ("text", "lengths"),
    [
        ("One two three four. Five six\nseven eight nine.", [4, 5]),
        ("At 2.5 mm/h it rains here. `a b c` is a code.", [6, 4]),
        ("- one two three four\n- five six seven eight nine", [4, 5]),
        ("| one two three four | five |\n| --- | --- |\n| six seven eight nine ten | 11 |", [4, 5]),
        ("See [the long name](a/page.md#part) of it, `musync sql DIR --to csv`.", [7]),
        ("# One two three four five\n\n```\nmusync sql of many words\n```\n\n![a b c d e](x.png)", []),
        ("---\nhide: [navigation, toc, and more]\n---\n\n*One two three four.*", [4]),
    ],
)
def test_sentences_are_those_of_the_prose(text, lengths):
    assert [len(sentence.split()) for sentence in list_sentences(text)] == lengths


def test_a_sentence_of_more_than_thirty_words_is_long_and_bars_of_tables_are_no_words(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(f"{'Word ' * 29}end. {'Word ' * 30}end.\n\n| one | two |\n| --- | --- |\n")
    assert measure_documents([page]) == (30 + 31 + 2, 0.5)


def test_a_module_is_imported_by_name_or_from_its_package():
    tree = ast.parse("import a.b\nfrom a import c, thing\ndef f():\n    from d.e import name\n")
    assert list_imports(tree, {"a", "a.b", "a.c", "d.e", "x"}) == {"a", "a.b", "a.c", "d.e"}


def test_a_constant_is_a_name_with_a_number_of_its_own():
    tree = ast.parse(
        "A = 0.5\nB: int = 3 * 60\nC = (1, -7)\nD = -1\nE = 2\nF = 'x'\nG = f(5)\nH = A\nI = True\n"
    )
    assert count_constants(tree) == 3
