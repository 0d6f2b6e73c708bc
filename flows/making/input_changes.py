"""Compare the inputs, parameters, scene and tools that made a dataset with those at hand."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from typing import Any

from catalogs.road_grade import ROAD_GRADE, name_grade_file, write_road_grade
from catalogs.scenes import scene_identity
from catalogs.sentences import cap_problems
from catalogs.vehicles import open_vehicle
from flows.making.grid_entries import read_entries
from flows.making.grid_inputs import grade_of
from flows.making.locations import find_scene, noted_location
from flows.store.address import send_files
from flows.store.layout import Layout, write_atomically
from flows.store.sealed import read_plan_record, recorded_grid, refuse_changed_files
from manifests.canonical import sha256_of
from manifests.explain import find_input_differences, find_parameter_differences, tools_here
from manifests.records import Manifest
from tasks.errors import InputError
from tasks.surface.weather import WEATHERS


def input_changes(layout: Layout, manifest: Manifest) -> list[dict[str, Any]]:
    """Every input that is no longer the recorded one, down to the value where the recorded bytes are still known.

    The scene, which lies elsewhere, is left to `scene_changes`.

    Parameters
    ----------
    layout, manifest : of a sealed dataset

    Returns
    -------
    Rows as of `manifests.explain.find_input_differences`, recorded value first.

    Raises
    ------
    InputError
        The dataset's plan is missing or no JSON.
    """
    plan = read_plan_record(layout)
    present = frozen_inputs(layout, manifest["inputs"])
    here = {
        **manifest,
        **tools_here(),
        "grid": plan["grid"],
        "inputs": {name: sha256_of([content]) for name, content in present.items()},
    }
    recorded = recorded_inputs(layout, manifest)
    return find_input_differences(manifest, here, recorded, present) + find_parameter_differences(
        manifest, plan
    )


def scene_changes(layout: Layout, manifest: Manifest) -> list[dict[str, Any]]:
    """The rows of `input_changes` on the scenes, where those at hand are others.

    Raises
    ------
    InputError
        The dataset's plan is missing or no JSON, or its scene cannot be found.
    """
    plan = read_plan_record(layout)
    here = {
        name: [scene | {"sha256": scene_identity(find_scene(scene))} for scene in scenes]
        for name, scenes in (("scene", [plan["scene"]]), ("scenes", plan.get("scenes", [])))
    }
    return find_input_differences(manifest, {**manifest, **here, "scene": here["scene"][0]}, {}, {})


def recorded_inputs(layout: Layout, manifest: Manifest) -> dict[str, bytes]:
    """The recorded bytes of the inputs, by name; those that nothing at hand has or gives are left out.

    Parameters
    ----------
    layout, manifest : of a sealed dataset
    """
    at_hand = read_entries(recorded_grid(manifest["grid"], layout.manifest), WEATHERS).contents
    found: dict[str, bytes] = {}
    for name, digest in manifest["inputs"].items():
        candidates = _read_candidates(layout, manifest, name, at_hand.get(name))
        content = next((one for one in candidates if sha256_of([one]) == digest), None)
        if content is not None:
            found[name] = content
    return found


def _read_candidates(layout: Layout, manifest: Manifest, name: str, at_hand: bytes | None) -> Iterator[bytes]:
    """Yield what may be an input: from the dataset, the catalogue, where it lay, or the scene that it follows from."""
    for file in (layout.inputs / name, noted_location(manifest["inputs"][name])):
        with suppress(InputError):
            if file is not None and file.is_file():
                yield file.read_bytes()
                if name == "vehicle.yaml":
                    yield open_vehicle(file).content
    if at_hand is not None:
        yield at_hand
    for scene in [manifest["scene"]] if name == ROAD_GRADE else manifest.get("scenes", []):
        if name in (ROAD_GRADE, name_grade_file(scene["name"])):
            with suppress(InputError):
                yield write_road_grade(grade_of(find_scene(scene)), scene["name"])


def read_kept(layout: Layout, recorded: Mapping[str, str]) -> dict[str, bytes]:
    """The catalogue files that a dataset keeps, by name, which are the recorded ones.

    Parameters
    ----------
    layout : of the dataset
    recorded : name to SHA-256, of its manifest or plan

    Raises
    ------
    InputError
        Listing every file that is missing or changed.
    """
    kept = frozen_inputs(layout, recorded)
    problems = [
        f"{layout}/inputs/{name}: must be as recorded; it is {'changed' if name in kept else 'missing'}: musync lab"
        " repair makes it again"
        for name, digest in recorded.items()
        if name not in kept or sha256_of([kept[name]]) != digest
    ]
    if problems:
        raise InputError(cap_problems(problems))
    return kept


def refuse_changed_records(layout: Layout, manifest: Manifest) -> None:
    """Raise `InputError` where a finished dataset's plan or a catalogue file that it keeps is not the recorded one."""
    read_kept(layout, manifest["inputs"])
    refuse_changed_files(layout, {"plan.json": manifest["artifacts"].get("plan.json", "")})


def frozen_inputs(layout: Layout, names: Iterable[str]) -> dict[str, bytes]:
    """Return the catalogue files that a dataset keeps, by name, without the missing ones."""
    files = {name: layout.inputs / name for name in names}
    return {name: file.read_bytes() for name, file in files.items() if file.is_file()}


def restore_inputs(layout: Layout, inputs: Mapping[str, bytes]) -> None:
    """Write the catalogue files that an unfinished dataset lacks.

    Parameters
    ----------
    layout : of the dataset, held for writing
    inputs : that its plan stands on, by name

    Raises
    ------
    InputError
        Listing those that are other files now: clips were made with them as they were.
    """
    kept = frozen_inputs(layout, inputs)
    if changed := [name for name in kept if kept[name] != inputs[name]]:
        raise InputError(
            [
                f"{layout}/inputs/{name}: must be the file that the run was planned with; it is changed: remove it, and"
                " the same command writes it again"
                for name in changed
            ]
        )
    lost = sorted(inputs.keys() - kept.keys())
    for name in lost:
        write_atomically(layout.inputs / name, inputs[name])
    send_files(layout, [layout.inputs / name for name in lost])
