"""Each rule of the truths of its own names the value that breaks it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

import studies.closing_benchmark
from studies.closing_benchmark.truths import load_truths
from tasks.errors import InputError


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda c: c["library"].update(magic={"a": 1}), "magic: the library"),
        (
            lambda c: c["outside"]["strut_step"].update(at=[0, 1]),
            "outside.strut_step: value must have one number for each of at",
        ),
        (
            lambda c: c["outside"]["strut_step"].update(at=[0, 0, 1, 2, 4]),
            "outside.strut_step: at must ascend in equal steps",
        ),
    ],
)
def test_a_broken_rule_is_named_with_its_place(
    tmp_path: Path, change: Callable[[Any], None], words: str
) -> None:
    content = yaml.safe_load((Path(studies.closing_benchmark.__file__).parent / "truths.yaml").read_text())
    change(content)
    path = tmp_path / "truths.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    with pytest.raises(InputError) as caught:
        load_truths(path)
    assert words in str(caught.value)
    assert all(str(path) in problem for problem in caught.value.problems)
