"""The built-in street, generated once and kept in the user's cache."""

import hashlib
import os
from pathlib import Path

import numpy as np
import scipy

import tasks.scene
from catalogs.scenes.folder import write_scene
from tasks.errors import InputError
from tasks.kernel_cache import cache_root


def cached_street(seed: int = 2025) -> Path:
    """The folder of the street with this seed; made on first use, and again when its code changes.

    Parameters
    ----------
    seed : of every texture and object
    """
    folder = cache_root() / f"street-{seed}-{_recipe_hash()}"
    if not (folder / "scene.json").is_file():
        from tasks.scene.street import build_street

        own = folder.with_name(f"{folder.name}.{os.getpid()}")
        write_scene(build_street(seed), own, {"source": "generated", "licence": "Apache-2.0"})
        try:
            own.rename(folder)
        except OSError:
            # another process was first, with the same bytes
            if not (folder / "scene.json").is_file():
                raise InputError(
                    f"{folder}: the cache of generated scenes must be writable; it is not"
                ) from None
    return folder


def _recipe_hash() -> str:
    """Over the code that makes the street and the libraries that it computes with."""
    digest = hashlib.sha256(f"{np.__version__} {scipy.__version__}".encode())
    package = Path(tasks.scene.__file__).parent
    for path in sorted(package.rglob("*.py")):
        if "stereo" not in path.parts:
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
