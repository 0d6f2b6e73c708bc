"""Scenes by name or folder: the built-in streets, and what was imported or reconstructed."""

import os
from functools import lru_cache
from pathlib import Path

from catalogs.scenes.folder import read_scene, scene_hash, write_scene
from catalogs.scenes.street import CHANGES, STREET_FILE, load_street_layout
from catalogs.scenes.street_cache import BUILT_IN_SEED, cached_street
from catalogs.sentences import shorten
from catalogs.street_names import KIND_FILES, KINDS, parse_street_name
from tasks.errors import InputError
from tasks.scene.route import Route
from tasks.scene.scene import Scene
from tasks.scene.street.bend import integrate_course, lay_route
from tasks.scene.street.layout import StreetLayout

BUILT_IN = tuple(CHANGES)
"""Streets that have a name of their own; those of a kind and a seed are named ``KIND-SEED``."""


def is_built_in(name: str) -> bool:
    """Whether a scene is a street that muSync makes by itself: of the catalogue, or of a kind and a seed.

    Parameters
    ----------
    name : of the scene
    """
    return find_recipe(name) is not None


def find_recipe(name: str) -> tuple[tuple[Path, ...], int] | None:
    """Return what `load_street_layout` and the seed make a street of; None of a scene that muSync does not make.

    Parameters
    ----------
    name : of the scene
    """
    if name in BUILT_IN:
        return CHANGES[name], BUILT_IN_SEED
    street = parse_street_name(name)
    return None if street is None else ((KIND_FILES[street.kind],), street.random_seed)


def scene_folder(name_or_folder: str | Path) -> Path:
    """The folder of a scene; a built-in street is generated on first use and kept in the user's cache.

    Raises
    ------
    InputError
        If there is no such scene; the sentence lists the built-in ones.
    """
    if (recipe := find_recipe(str(name_or_folder))) is not None:
        return cached_street(*recipe[0], seed=recipe[1])
    folder = Path(name_or_folder)
    # unlike Path.is_file this takes a name that no file can have for one that is not there
    if not os.path.isfile(folder / "scene.json"):
        raise InputError(
            f"scene {shorten(name_or_folder)}: no such scene; give a scene folder, one of {', '.join(BUILT_IN)}, or a"
            f" street of a kind and a seed, such as town-7; kinds are {', '.join(KINDS)}"
        )
    return folder


def load_recipe(name_or_folder: str) -> tuple[StreetLayout, int] | None:
    """Return the layout and the seed that a built-in street is made of; None of any other scene.

    Parameters
    ----------
    name_or_folder : of the scene
    """
    if (recipe := find_recipe(name_or_folder)) is None:
        return None
    changes, seed = recipe
    return load_street_layout(STREET_FILE, *changes, seed=seed), seed


@lru_cache(maxsize=2)
def load_scene(name_or_folder: str) -> Scene:
    """Read a scene and verify it.

    Parameters
    ----------
    name_or_folder : a built-in name, or a scene folder

    Raises
    ------
    InputError
        If it is missing, damaged, or holds a value that no scene may hold.
    """
    return read_scene(scene_folder(name_or_folder))


@lru_cache(maxsize=256)
def load_route(name_or_folder: str) -> Route:
    """Return the route of a scene; that of a street which muSync makes follows from its entry, without its Gaussians.

    Parameters
    ----------
    name_or_folder : as of `load_scene`

    Raises
    ------
    InputError
        As `load_scene` raises it.
    """
    recipe = find_recipe(name_or_folder)
    if recipe is None:
        return load_scene(name_or_folder).route
    layout = load_street_layout(STREET_FILE, *recipe[0], seed=recipe[1])
    return lay_route(layout, integrate_course(layout))


def scene_identity(name_or_folder: str) -> str:
    """SHA-256 that identifies a scene's content."""
    return scene_hash(scene_folder(name_or_folder))


__all__ = ["load_route", "load_scene", "scene_folder", "scene_identity", "write_scene"]
