"""A scene from a posed stereo sequence."""

from pathlib import Path
from typing import Any

from catalogs.scenes import write_scene
from catalogs.scenes.folder import must_be_new
from catalogs.scenes.stereo_folder import read_stereo_folder
from tasks.scene.stereo.reconstruct import reconstruct


def scene_from_stereo(folder: str, out: str) -> dict[str, Any]:
    """Build a scene from a posed stereo sequence and report its held-out figures.

    Raises
    ------
    InputError
        Listing every problem of the folder, or if ``out`` is not empty.
    """
    must_be_new(Path(out))
    result = reconstruct(read_stereo_folder(Path(folder)))
    figures = result.figures()
    write_scene(result.scene, Path(out), figures)
    return {"scene": out, **figures}
