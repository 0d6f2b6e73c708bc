"""The plans that ship are read, and a rule of their own names the value that breaks it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from studies.measured_drives.plans import FOLDER, load_plan
from tasks.errors import InputError


@pytest.mark.parametrize(
    ("kind", "name", "change", "words"),
    [
        (
            "bus",
            "a2d2-like",
            lambda c: c["signals"][1].update(unit="bar"),
            "signals.1: unit bar is of pressure, m/s of speed",
        ),
        (
            "stop study",
            "bmw-m8",
            lambda c: c["rungs"][2]["fixed"]["drag_area"].update(unit="furlong"),
            "rungs.2.fixed: unit of drag_area must be m2; it is furlong",
        ),
    ],
)
def test_a_broken_rule_is_named_with_its_place(
    tmp_path: Path, kind: str, name: str, change: Callable[[Any], object], words: str
) -> None:
    content = yaml.safe_load((FOLDER / f"{name}.yaml").read_text())
    change(content)
    path = tmp_path / "plan.yaml"
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(InputError) as caught:
        load_plan(kind, path)
    assert words in str(caught.value)
    assert load_plan(kind, name)
