"""The pictures of a finished dataset: its checked Zarr store, and the arrays with labels and times as coordinates."""

from collections.abc import Mapping
from typing import Any

from catalogs.sentences import cap_problems, shorten
from flows.store.address import frames_store, open_for_reading
from flows.store.frame_metadata import check_frames, read_local_metadata
from flows.store.layout import Layout
from flows.store.objects import Objects
from flows.store.sealed import require_frames
from tasks.conventions import CHANNELS_BY_NAME
from tasks.errors import InputError


def open_frames_store(layout: Layout, manifest: Mapping[str, Any]) -> Any:
    """Return the Zarr store of the frames, after checking that muSync wrote its metadata.

    Parameters
    ----------
    layout : of the dataset, in a folder or an object store
    manifest : its frozen manifest

    Raises
    ------
    InputError
        If the dataset was made without frames, a folder lacks some of them, which Zarr would take for black, or their
        metadata are not those that muSync writes. In an object store one that is missing is reported when it is read.
    """
    grid = manifest["grid"]
    require_frames(manifest, layout)
    if grid["pictures"] == "later":
        from flows.reading.recipes import open_recipes

        return open_recipes(layout, manifest).as_zarr()
    if layout.origin is None:
        open_for_reading(layout.root, lambda name: name.startswith("frames.zarr/"))
        read = read_local_metadata(layout.frames)
        members = [path.name for path in layout.frames.glob("*") if path.is_dir()]
        _refuse_missing(layout, manifest)
    else:
        objects = Objects(f"{layout.origin}/{layout.frames.name}")
        read, members = objects.read, objects.folders()
    check_frames(read, members, f"{layout}/{layout.frames.name}", len(manifest["clips"]), grid["frames"])
    return frames_store(layout, (path for clip in manifest["clips"] for path in clip["artifacts"]))


def _refuse_missing(layout: Layout, manifest: Mapping[str, Any]) -> None:
    missing = [
        f"{layout}/{path}: missing, with pictures of clip {clip['label']}: musync lab repair makes it again"
        for clip in manifest["clips"]
        for path in clip["artifacts"]
        if not (layout.root / path).is_file()
    ]
    if missing:
        raise InputError(cap_problems(missing))


def open_labelled_frames(layout: Layout, manifest: Mapping[str, Any]) -> Any:
    """Return the frames as a lazy xarray dataset, its clips by label and its frames with the time
    of the tick that they show.

    Parameters
    ----------
    layout, manifest : as for `open_frames_store`

    Raises
    ------
    InputError
        If xarray is not installed, or as for `open_frames_store`.
    """
    try:
        import xarray
    except ImportError:
        raise InputError("xarray is not installed: pip install 'musync-gs[analysts]'") from None
    # it imports what makes clips, which a query need not wait for
    from catalogs.grids.form import TICK_RATE_HZ
    from flows.making.plan import frame_ticks

    try:
        pixels = xarray.open_zarr(
            open_frames_store(layout, manifest),
            consolidated=False,
            zarr_format=3,
            chunks=None,
            decode_cf=False,
        )
    except (ValueError, TypeError, KeyError) as error:
        raise InputError(
            f"{layout}/frames.zarr: {shorten(error)}: musync verify says whether it is damaged"
        ) from None
    clips, time = manifest["clips"], CHANNELS_BY_NAME["t_ns"]
    seconds = frame_ticks(pixels.sizes["frame"], manifest["grid"]["frame_rate_hz"]) / TICK_RATE_HZ
    units = {"standard_name": time.standard_name, "long_name": time.description, "units": "s"}
    return pixels.assign_coords(
        clip=[clip["label"] for clip in clips],
        clip_id=("clip", [clip["clip_id"] for clip in clips]),
        t=("frame", seconds, units),
    )
