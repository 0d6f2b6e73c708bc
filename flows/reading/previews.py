"""Films of a dataset's clips, with the vehicle's traces below the picture."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flows.making.plan import Plan
from flows.reading.film import write_film
from flows.reading.frames import Frames, open_frames
from flows.reading.suggestions import suggest_clips
from flows.running.progress import progress_bar
from flows.store.address import open_for_reading
from flows.store.outputs import Outputs
from flows.store.sealed import read_manifest, refuse_changed_clips, require_frames
from flows.store.telemetry import read_columns
from tasks.errors import InputError
from tasks.render.traces import TRACES, add_traces

NAME_BYTES = 150
"""Of a label that a film's name keeps [B]."""


def make_films(
    dataset: str, out: str, *, clips: list[str] | None = None, traces: bool = True
) -> dict[str, Any]:
    """Write one MP4 a clip.

    Parameters
    ----------
    dataset : a finished dataset
    out : folder for the films
    clips : labels or clip ids; all by default
    traces : whether speed, slip, pitch, load and brake pressure run below the picture

    Raises
    ------
    InputError
        The folder holds no finished dataset, a clip is not in it, or what is shown of it is not as recorded.
    """
    layout = open_for_reading(dataset)
    if not layout.manifest.is_file():
        raise InputError(f"{dataset}: must be a finished dataset; it has no manifest.json")
    manifest = read_manifest(layout)
    plan, rows = Plan.of(manifest, layout.manifest), manifest["clips"]
    require_frames(manifest, dataset)
    chosen = select_clips(rows, clips, dataset) if clips else rows
    refuse_changed_clips(layout, manifest, chosen, "frames")
    names = name_films(rows)
    results = Outputs(out, "lab preview", *(names[row["clip_id"]] for row in chosen))
    films, frames = [], open_frames(layout, manifest)
    with progress_bar("films", len(chosen)) as advance:
        for row in chosen:
            film = BytesIO()
            write_film(film, _draw_pictures(frames, row, traces), plan.settings.frame_rate_hz)
            name = names[row["clip_id"]]
            results.write(name, film.getvalue())
            films.append(str(results.path(name)))
            advance(row["label"])
    return {"films": films}


def name_films(rows: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """File name of each clip's film, by clip id: its label, made a file name; no two are the same.

    Parameters
    ----------
    rows : all clips of a dataset, so that a name does not depend on which of them are filmed
    """
    stems = {row["clip_id"]: _file_stem(row["label"]) for row in rows}
    counts = Counter(stem.casefold() for stem in stems.values())
    # a label that ends like a name with an id gets one too: it could be the name of that id's clip
    alone = {
        stem
        for stem in stems.values()
        if counts[stem.casefold()] == 1 and stem.rpartition("-")[2] not in stems
    }
    return {
        clip_id: f"{stem}.mp4" if stem in alone else f"{stem}-{clip_id}.mp4"
        for clip_id, stem in stems.items()
    }


def _file_stem(label: str) -> str:
    """A label without what a file name cannot hold or a shell would read."""
    plain = re.sub(r"[^\w.,+=@ -]", "_", label).lstrip(".-") or "clip"
    return plain.encode()[:NAME_BYTES].decode(errors="ignore")


def select_clips(
    rows: Sequence[Mapping[str, Any]], names: Sequence[str], dataset: str
) -> list[Mapping[str, Any]]:
    """The clips of these labels or ids, in the dataset's order.

    Raises
    ------
    InputError
        Listing every name that no clip has.
    """
    unknown = set(names) - {row[key] for row in rows for key in ("label", "clip_id")}
    if unknown:
        raise suggest_clips(dataset, sorted(unknown), [row["label"] for row in rows])
    return [row for row in rows if row["label"] in names or row["clip_id"] in names]


def _draw_pictures(frames: Frames, row: Mapping[str, Any], traces: bool) -> list[NDArray[np.uint8]]:
    pictures = list(frames.read(row["index"], "rgb"))
    if not traces:
        return pictures
    names = [trace.column for trace in TRACES]
    columns = read_columns(frames.layout.telemetry / "frames", row["clip_id"], names, most=len(pictures))
    return [add_traces(picture, columns, frame) for frame, picture in enumerate(pictures)]
