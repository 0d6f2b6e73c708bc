"""Frozen runs: scenarios, seeds, parameters and the hash of each clip's telemetry, small enough to ship.

A dataset's manifest (`manifests.manifest`) seals what was made, file by file, and its ids follow from the bytes of
every input. A frozen run says what has to come out again; the code's state is recorded, and judged by the outcome.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from catalogs.documents import read_json_document
from catalogs.weather.grip import GRIP_SECTIONS
from manifests.explain import REACHES, VEHICLE, find_value_differences, format_value, kind_of_input
from manifests.manifest import seal_of
from manifests.records import FrozenRun, check_record
from tasks.errors import InputError

FROZEN_FORMAT = "musync-frozen/1"
FOLDER = Path(__file__).parent / "frozen"
NEVER_DECIDES = ("source",)
"""Keys of a catalogue entry that no number follows from."""


def list_frozen() -> tuple[str, ...]:
    """Names of the frozen runs that ship with the project."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.json")))


def find_frozen(name_or_path: str | Path) -> Path:
    """Return the file of a frozen run: a path ending in .json as it is, a name from those that ship.

    Raises
    ------
    InputError
        If there is none; the sentence lists those that exist.
    """
    path = Path(name_or_path)
    if path.suffix != ".json":
        path = FOLDER / f"{name_or_path}.json"
    if not path.is_file():
        raise InputError(
            f"manifest {name_or_path}: no such frozen run; give a JSON file or one of: {', '.join(list_frozen())}"
        )
    return path


def read_frozen(name_or_path: str | Path) -> FrozenRun:
    """Read a frozen run.

    Raises
    ------
    InputError
        If there is none, or it is of another format, was changed by hand, or breaks a rule.
    """
    path = find_frozen(name_or_path)
    frozen = read_json_document(path, "frozen run")
    found = frozen.get("format") if isinstance(frozen, dict) else None
    if found != FROZEN_FORMAT:
        raise InputError(
            f"{path}: a frozen run must be of format {FROZEN_FORMAT}; it is {found!r}"
            " (the manifest.json of a dataset is no frozen run: musync lab freeze makes one of its grid)"
        )
    if seal_of(frozen) != frozen.get("seal"):
        raise InputError(f"{path}: its seal does not match its content: it was changed after it was frozen")
    return check_record(FrozenRun, frozen, path)


def seal_run(run: Mapping[str, Any]) -> dict[str, Any]:
    """A frozen run with its format and seal.

    Parameters
    ----------
    run : name, grid, parameters, clips, scene, made_with and processor
    """
    whole = {"format": FROZEN_FORMAT, **run}
    return whole | {"seal": seal_of(whole)}


def parameters_that_matter(inputs: Mapping[str, Any], pictures: bool) -> dict[str, Any]:
    """Catalogue entries that reach the run: with pictures all, for telemetry alone those of the vehicle's motion.

    Parameters
    ----------
    inputs : parsed entries by their name under ``inputs/``
    pictures : whether frames are made
    """
    kept = inputs if pictures else {name: _keep_motion(name, entry) for name, entry in inputs.items()}
    return {name: _keep_deciding(entry) for name, entry in kept.items() if entry is not None}


def find_differences(
    frozen: Mapping[str, Any], parameters: Mapping[str, Any], clips: Sequence[Mapping[str, Any]]
) -> list[str]:
    """List the values at hand that differ from the frozen ones; hashes of telemetry are compared elsewhere.

    Parameters
    ----------
    frozen : the frozen run
    parameters : `parameters_that_matter` of what is here
    clips : records of the clips as the grid makes them here
    """
    rows = find_value_differences(frozen["parameters"], dict(parameters))
    asked = {clip["label"]: _without_hash(clip) for clip in frozen["clips"]}
    rows += find_value_differences(asked, {clip["label"]: _without_hash(clip) for clip in clips}, "clips")
    return [
        f"{field} is {format_value(there)} in the manifest and {format_value(here)} here"
        for field, there, here in rows
    ]


def find_differing_clips(frozen: Mapping[str, Any], ticks: Mapping[str, str]) -> list[str]:
    """Labels of the clips whose telemetry is not the frozen one.

    Parameters
    ----------
    frozen : the frozen run
    ticks : label to the hash of the telemetry that came out
    """
    return [clip["label"] for clip in frozen["clips"] if ticks.get(clip["label"]) != clip["ticks"]]


def _without_hash(clip: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in clip.items() if key != "ticks"}


def _keep_motion(name: str, entry: Any) -> Any:
    """Return what of an entry reaches the vehicle's motion: of a kind of weather its grip alone."""
    if PurePosixPath(name).parts[0] == "weather":
        return {section: entry[section] for section in GRIP_SECTIONS if section in entry} or None
    return entry if VEHICLE in REACHES.get(kind_of_input(name), ()) else None


def _keep_deciding(entry: Any) -> Any:
    if isinstance(entry, dict):
        return {str(key): _keep_deciding(value) for key, value in entry.items() if key not in NEVER_DECIDES}
    return [_keep_deciding(value) for value in entry] if isinstance(entry, list) else entry
