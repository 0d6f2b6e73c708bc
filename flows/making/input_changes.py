"""Compare the inputs, parameters, scene and tools that made a dataset with those at hand."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from catalogs.scenes import scene_identity
from catalogs.sentences import cap_problems
from flows.making.grid_inputs import READERS, input_sources
from flows.making.places import find_scene, noted_place
from flows.store.address import send_files
from flows.store.layout import Layout, write_atomically
from flows.store.sealed import read_plan_record, recorded_grid, refuse_changed_files
from manifests.canonical import sha256_of, sha256_of_file
from manifests.explain import find_input_differences, find_parameter_differences, tools_here
from manifests.records import Manifest
from tasks.errors import InputError


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
    sources = input_sources(recorded_grid(manifest["grid"], layout.manifest))
    recorded = {
        name: content
        for name, digest in manifest["inputs"].items()
        if (content := recorded_input(layout, sources, name, digest)) is not None
    }
    return find_input_differences(manifest, here, recorded, present) + find_parameter_differences(
        manifest, plan
    )


def scene_changes(layout: Layout, manifest: Manifest) -> list[dict[str, Any]]:
    """The row of `input_changes` on the scene, where the one at hand is another.

    Raises
    ------
    InputError
        The dataset's plan is missing or no JSON, or its scene cannot be found.
    """
    found = scene_identity(find_scene(read_plan_record(layout)["scene"]))
    return find_input_differences(manifest, {**manifest, "scene": {"sha256": found}}, {}, {})


def recorded_input(
    layout: Layout, sources: Mapping[str, Callable[[], Path]], name: str, digest: str
) -> bytes | None:
    """The recorded bytes of an input, from the dataset, the catalogue or where it lay; None if none has them.

    Parameters
    ----------
    layout : of the dataset
    sources : `flows.making.grid_inputs.input_sources` of its grid
    name, digest : of the input
    """
    for find in (lambda: layout.inputs / name, sources.get(name), lambda: noted_place(digest)):
        try:
            file = find() if find is not None else None
            if file is None or not file.is_file():
                continue
            if sha256_of_file(file) == digest:
                return file.read_bytes()
            if name in READERS and sha256_of([content := READERS[name](file)]) == digest:
                return content
        except InputError:
            continue
    return None


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
        f"{layout}/inputs/{name}: must be as recorded; it is {'changed' if name in kept else 'missing'}: musync repair"
        " makes it again"
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
