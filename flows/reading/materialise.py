"""``musync materialise``: the frames that a dataset makes when they are read, made beforehand on all processors."""

from typing import Any

from catalogs.entries import load
from flows.making.generate import fan_out, open_workers
from flows.reading.describe import estimate_cost
from flows.reading.frames import open_frames
from flows.reading.previews import select_clips
from flows.reading.recipes import BOUND, Recipes, forget_oldest, read_bound
from flows.running.runner import RunnerName, check_runner
from flows.store.address import open_for_reading, want_telemetry
from flows.store.sealed import is_committed, read_manifest, read_receipt, require_frames
from manifests.manifest import is_quarantined
from tasks.errors import InputError


def materialise_frames(
    dataset: str, *, clips: list[str] | None = None, runner: RunnerName = "dask", workers: int | None = None
) -> dict[str, Any]:
    """Make the frames of clips into the user's cache, where all readers find them; those that are there stay.

    Parameters
    ----------
    dataset : a finished dataset that was made with ``--frames later``
    clips : labels or clip ids; all by default
    runner, workers : as of `flows.making.generate.generate_dataset`

    Returns
    -------
    ``clips``, ``made``, ``quarantined`` (reasons by label of the clips whose pose check failed), ``cache`` (its folder)
    and ``megabytes``, estimated

    Raises
    ------
    InputError
        If the dataset stores its frames or has none, the clips do not fit into the cache, or as
        `flows.reading.recipes.Recipes.find` raises it.
    ClipsFailed
        If clips failed; run the same command again to make just those.
    """
    check_runner(runner, None)
    layout = open_for_reading(dataset, want_telemetry)
    manifest = read_manifest(layout)
    require_frames(manifest, dataset)
    recipes = open_frames(layout, manifest)
    if not isinstance(recipes, Recipes):
        raise InputError(f"{dataset}: stores its frames; there are none to make")
    chosen = select_clips(manifest["clips"], clips, dataset) if clips else manifest["clips"]
    plan, cache = recipes.plan, recipes.cache
    camera = load("camera", layout.inputs / "camera.yaml")
    megabytes = estimate_cost(plan.settings, camera, len(chosen), pictures=True)["megabytes"]
    if megabytes > 1e3 * (bound := read_bound()):
        raise InputError(
            f"{dataset}: the frames of {len(chosen)} clips take about {megabytes / 1e3:.3g} GB, and the cache of frames"
            f" holds {bound:g}: name fewer with --clip, or set {BOUND}"
        )
    recipes.prepare_cache()
    indices = [row["index"] for row in chosen]
    rows = plan.settings.rows_per_clip
    missing = [k for k in indices if not is_committed(cache, plan.clips[k].as_json(), rows)]
    with open_workers(cache, plan, runner, workers, None) as executor:
        fan_out(cache, plan, missing, executor)
    forget_oldest(keep={recipes.receipt(k) for k in indices})
    for k in indices:
        recipes.refuse_other_motion(k)
    receipts = [read_receipt(cache, row["clip_id"]) for row in chosen]
    return {
        "clips": len(chosen),
        "made": len(missing),
        "quarantined": {row["label"]: row["verdict"]["reasons"] for row in receipts if is_quarantined(row)},
        "cache": str(cache.root),
        "megabytes": megabytes,
    }
