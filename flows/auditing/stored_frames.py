"""The frames of a dataset as other readers meet them: metadata of the Zarr arrays, and the contact sheet."""

from collections.abc import Collection, Iterator
from typing import Any

from catalogs.documents import parse_json
from catalogs.sentences import cap_problems
from flows.auditing.footers import FREE_TEXT
from flows.auditing.stored_tables import Difference
from flows.making.gathering import table_parts
from flows.making.generate import describe_frame_arrays
from flows.making.plan import Plan
from flows.making.seal import SHEET, preview_sheet
from flows.store.frame_metadata import check_frames, read_local_metadata
from flows.store.frames import encode_arrays
from flows.store.layout import Layout
from flows.store.links import require_file
from manifests.explain import ABSENT, find_value_differences, format_value
from manifests.records import Manifest
from tasks.errors import InputError

_SHOWN = 4
"""Sentences about one file."""


def compare_frame_metadata(
    layout: Layout, plan: Plan, damaged: Collection[str], is_same_writer: bool
) -> Iterator[Difference]:
    """Yield each ``zarr.json`` that is not the one of the empty arrays that the plan and the kept camera make.

    Parameters
    ----------
    layout, plan : of a sealed dataset
    damaged : paths that are not read
    is_same_writer : whether code and libraries are those that wrote the dataset; else only attributes that both have
        are compared, and words among them may be others
    """
    if not plan.settings.stores_frames or "inputs/camera.yaml" in damaged:
        return
    try:
        arguments = describe_frame_arrays(layout, plan)
    except InputError as error:
        yield "inputs/camera.yaml", list(error.problems)
        return
    for name, wanted in encode_arrays(**arguments).items():
        path = f"{layout.frames.name}/{name}"
        if path in damaged:
            continue
        try:
            content = require_file(layout.root / path).read_bytes()
            if content == wanted:
                continue
            if not is_same_writer:
                members = [member.name for member in layout.frames.iterdir() if member.is_dir()]
                check_frames(
                    read_local_metadata(layout.frames), members, layout.frames.name, *arguments["shape"][:2]
                )
            ours, theirs = (parse_json(text, path, "metadata") for text in (wanted, content))
            lies = list(_compare_values(ours, theirs, is_same_writer))
        except InputError as error:
            lies = list(error.problems)
        yield path, [lie if lie.startswith(path) else f"{path}: {lie}" for lie in cap_problems(lies, _SHOWN)]


def _compare_values(wanted: Any, found: Any, is_same_writer: bool) -> Iterator[str]:
    if not is_same_writer:
        wanted, found = ({"attributes": value.get("attributes", {})} for value in (wanted, found))
    for field, a, b in find_value_differences(wanted, found):
        if is_same_writer or not (field.rpartition(".")[2] in FREE_TEXT or ABSENT in (a, b)):
            yield (
                f"{field} must be {format_value(a)}, by the plan and the kept camera; it is {format_value(b)}"
            )


def draw_sheet_again(layout: Layout, manifest: Manifest, plan: Plan) -> bytes:
    """Return the contact sheet of a dataset with pictures, drawn of the stored pictures and tables.

    Parameters
    ----------
    layout, manifest, plan : of a sealed dataset

    Raises
    ------
    InputError
        If a picture or a table that it shows cannot be read.
    """
    parts = {clip_id: path for path, ids in table_parts(plan, "frames").items() for clip_id in ids}
    return preview_sheet(
        layout, plan, manifest["clips"], lambda clip_id: require_file(layout.root / parts[clip_id])
    )


def compare_sheet(
    layout: Layout, manifest: Manifest, plan: Plan, damaged: Collection[str]
) -> Iterator[Difference]:
    """Yield the contact sheet where it is another than `draw_sheet_again` draws.

    Parameters
    ----------
    layout, manifest, plan : of a sealed dataset
    damaged : paths that are not read
    """
    if plan.settings.stores_frames and SHEET not in damaged:
        try:
            same = require_file(layout.root / SHEET).read_bytes() == draw_sheet_again(layout, manifest, plan)
        except InputError as error:
            yield SHEET, list(error.problems)
            return
        if not same:
            yield SHEET, []
