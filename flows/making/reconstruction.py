"""A scene from a posed stereo sequence."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from catalogs.scenes import write_scene
from catalogs.scenes.folder import must_be_new
from catalogs.scenes.stereo_folder import read_stereo_folder
from tasks.errors import InputError
from tasks.reconstruction.reconstruct import reconstruct_street
from tasks.scene.scene import find_sun_problems


def scene_from_stereo(
    folder: str, out: str, *, sun_direction_deg: tuple[float, float] | None = None
) -> dict[str, Any]:
    """Build a scene from a posed stereo sequence and report its held-out figures.

    Parameters
    ----------
    sun_direction_deg : azimuth and elevation of the sun, as in `Scene` [deg]

    Raises
    ------
    InputError
        Listing every problem of the folder, or if ``out`` is not empty, or the sun below the horizon.
    """
    must_be_new(Path(out))
    if problems := find_sun_problems(sun_direction_deg):
        raise InputError(problems)
    result = reconstruct_street(read_stereo_folder(Path(folder)))
    figures = result.summarise()
    write_scene(replace(result.scene, sun_direction_deg=sun_direction_deg), Path(out), figures)
    return {"scene": out, **figures}
