"""Reading a finished dataset's manifest, without what it takes to make one."""

from typing import Any

from flows.store.layout import Layout, read_json
from manifests.manifest import check_format
from tasks.errors import InputError


def read_manifest(layout: Layout) -> dict[str, Any]:
    """The manifest of a sealed dataset.

    Raises
    ------
    InputError
        If the run is unfinished, or the manifest is missing or of another format.
    """
    if layout.plan.is_file() and not layout.manifest.is_file():
        clips = read_json(layout.plan)["clips"]
        done = sum(layout.receipt(clip["clip_id"]).is_file() for clip in clips)
        raise InputError(
            f"{layout}: the dataset must be finished; {done} of {len(clips)} clips are made:"
            " run its musync generate command again"
        )
    manifest: dict[str, Any] = read_json(layout.manifest)
    check_format(manifest, layout.manifest)
    return manifest
