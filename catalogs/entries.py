"""Finding a catalogue entry by name or by file."""

from pathlib import Path

from tasks.errors import InputError


def find_entry(folder: Path, name_or_path: str | Path, kind: str) -> Path:
    """The YAML file of an entry: a path ending in .yaml is taken as it is, a name is looked up in ``folder``.

    Raises
    ------
    InputError
        If there is no such entry; the sentence lists those that exist.
    """
    path = Path(name_or_path)
    if path.suffix not in {".yaml", ".yml"}:
        path = folder / f"{name_or_path}.yaml"
    if not path.is_file():
        known = ", ".join(sorted(entry.stem for entry in folder.glob("*.yaml")))
        raise InputError(f"{kind} {name_or_path}: no such entry; give a YAML file or one of: {known}")
    return path
