"""Films of a dataset's clips, with the vehicle's traces below the picture."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flows.making.plan import read_plan
from flows.reading.film import write_film
from flows.running.progress import progress_bar
from flows.store.address import reading
from flows.store.frames import read_clip
from flows.store.layout import Layout, read_json
from flows.store.telemetry import read_columns
from tasks.errors import InputError
from tasks.render.traces import with_traces


def preview(dataset: str, out: str, *, clips: list[str] | None = None, traces: bool = True) -> dict[str, Any]:
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
        The folder holds no finished dataset, or a clip is not in it.
    """
    layout = reading(dataset)
    if not layout.manifest.is_file():
        raise InputError(f"{dataset}: must be a finished dataset; it has no manifest.json")
    plan, rows = read_plan(layout.root), read_json(layout.manifest)["clips"]
    if not plan.settings.pictures:
        raise InputError(f"{dataset}: must be a dataset with frames; it was made with --no-frames")
    chosen = named_clips(rows, clips, dataset) if clips else rows
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    films = []
    with progress_bar("films", len(chosen)) as advance:
        for row in chosen:
            film = folder / f"{row['label'].replace('/', '_')}.mp4"
            write_film(film, _pictures(layout, row, traces), plan.settings.frame_rate_hz)
            films.append(str(film))
            advance(row["label"])
    return {"films": films}


def named_clips(rows: Sequence[dict[str, Any]], names: Sequence[str], dataset: str) -> list[dict[str, Any]]:
    """The clips of these labels or ids, in the dataset's order.

    Raises
    ------
    InputError
        Listing every name that no clip has.
    """
    unknown = set(names) - {row[key] for row in rows for key in ("label", "clip_id")}
    if unknown:
        raise InputError(
            [f"{dataset}: no clip {name!r}; musync describe lists them" for name in sorted(unknown)]
        )
    return [row for row in rows if row["label"] in names or row["clip_id"] in names]


def _pictures(layout: Layout, row: dict[str, Any], traces: bool) -> list[NDArray[np.uint8]]:
    pictures = list(read_clip(layout.frames, row["index"], "rgb"))
    if not traces:
        return pictures
    columns = read_columns(layout.telemetry / "frames", row["clip_id"])
    return [with_traces(picture, columns, frame) for frame, picture in enumerate(pictures)]
