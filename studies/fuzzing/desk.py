"""Sound documents laid out in a folder, and what their loader says of a changed one."""

import contextlib
import io
import shutil
import tempfile
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from studies.fuzzing.inputs import Documents, Input, make_input
from studies.fuzzing.parser import Parser
from studies.fuzzing.parsers import BY_NAME
from tasks.errors import InputError

LONGEST_MESSAGE = 20_000
"""Characters of all the sentences about one input."""

Outcome = Literal["refused", "accepted", "traceback", "hang", "memory", "silent"]
FINDINGS: tuple[Outcome, ...] = ("traceback", "hang", "memory", "silent")


def read_input(documents: Documents, made: Input, folder: Path) -> tuple[Outcome, str]:
    """Hand an input to its parser.

    Parameters
    ----------
    documents : of the parser
    made : the input
    folder : holds the sound document, and holds it again afterwards
    """
    parser, sound = documents.parser, documents.files[made.document]
    try:
        for name, content in made.changed.items():
            (folder / name).write_bytes(content)
        return _read_documents(parser, folder, made.broken)
    finally:
        if parser.writes:
            shutil.rmtree(folder)
            lay_out(sound, folder)
        for name in made.changed:
            (folder / name).write_bytes(sound[name])


def _read_documents(parser: Parser, folder: Path, broken: str | None) -> tuple[Outcome, str]:
    try:
        parser.read(folder)
    except InputError as error:
        length = sum(map(len, error.problems))
        if not 0 < length <= LONGEST_MESSAGE or not all(error.problems):
            return "traceback", f"sentences of {length} characters"
        return "refused", error.problems[0]
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt | SystemExit):
            raise
        return (
            "traceback",
            f"{_find_place(error)} {type(error).__name__}: {' '.join(str(error).split())[:120]}",
        )
    return ("silent", f"accepted although {broken}") if broken else ("accepted", "")


def _find_place(error: BaseException) -> str:
    """File and line of the project from which an exception comes."""
    root = Path(__file__).parents[2]
    own = [
        f"{Path(frame.filename).relative_to(root)}:{frame.lineno}"
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename.startswith(f"{root}/")
        and "/.venv/" not in frame.filename
        and Path(frame.filename).is_file()
    ]
    return own[-1] if own else "elsewhere"


def lay_out(files: dict[str, bytes], folder: Path) -> None:
    """Write a document's files below a folder."""
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)


def write_documents(parsers: Sequence[Parser], shelf: Path) -> None:
    """Write the sound documents of the parsers, a folder each, and see that their loaders take them."""
    for parser in parsers:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            parser.write(shelf / parser.name)
        for document in sorted((shelf / parser.name).iterdir()):
            with tempfile.TemporaryDirectory() as place:
                copy = shutil.copytree(document, Path(place) / document.name)
                parser.read(copy)


class Desk:
    """Sound documents laid out where inputs are read, as they are needed.

    Parameters
    ----------
    shelf : where `write_documents` wrote them
    place : scratch folder
    """

    def __init__(self, shelf: Path, place: Path):
        self._shelf, self._place = shelf, place
        self._documents: dict[str, Documents] = {}

    def read(self, name: str, seed: int, number: int) -> tuple[Input, Outcome, str]:
        """Make and read one input."""
        documents = self.open(name)
        made = make_input(documents, seed, number)
        return made, *read_input(documents, made, self._place / name / made.document)

    def open(self, name: str) -> Documents:
        """The documents of a parser; read once, so that no input's time is that of imports and compilers."""
        if name not in self._documents:
            documents = self._documents[name] = Documents(BY_NAME[name], self._shelf / name)
            for document, files in documents.files.items():
                folder = self._place / name / document
                lay_out(files, folder)
                read_input(
                    documents, Input(document=document, changed={}, what="nothing", broken=None), folder
                )
        return self._documents[name]
