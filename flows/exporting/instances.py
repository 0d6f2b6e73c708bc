"""Objects of the built-in street in a dataset's frames: found from depth, class and pose; no dataset stores them."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isnan
from typing import Any

from catalogs.scenes import find_recipe, load_scene, scene_identity
from catalogs.scenes.street import STREET_FILE, load_street_layout
from tasks.render.camera import Camera
from tasks.render.instances import InstanceFinder
from tasks.scene.street.objects import StreetObject, list_objects, own_gaussians


@dataclass(frozen=True, kw_only=True)
class SceneObjects:
    """Objects of a scene, and what finds them in a frame.

    Parameters
    ----------
    objects : in the order of their numbers
    finder : of their pixels
    """

    objects: tuple[StreetObject, ...]
    finder: InstanceFinder


def find_scene_objects(scene: Mapping[str, Any], camera: Camera) -> SceneObjects | None:
    """Return the objects of a scene.

    None where they are not known, or not to be found in its pictures: of a scene that is no street of this version of
    muSync, with a lens that distorts, and with a shutter that takes the rows one after the other.

    Parameters
    ----------
    scene : ``name`` and ``sha256``, of a plan
    camera : of the pictures
    """
    name, recipe = scene["name"], find_recipe(scene["name"])
    if recipe is None or camera.distortion is not None or camera.line_delay_s or camera.motion_blur:
        return None
    if scene["sha256"] != scene_identity(name):
        return None
    changes, seed = recipe
    objects, owners, classes = list_objects(load_street_layout(STREET_FILE, *changes, seed=seed), seed)
    cloud = load_scene(name).gaussians
    return SceneObjects(objects=objects, finder=InstanceFinder(cloud, own_gaussians(cloud, owners, classes)))


def describe_object(thing: StreetObject) -> dict[str, Any]:
    """Return the box of an object in the world as JSON has it: metres, and radians from the world's x.

    Parameters
    ----------
    thing : the object
    """
    return {
        "id": thing.number,
        "kind": thing.kind,
        "centre": thing.centre.tolist(),
        "size": thing.size.tolist(),
        "heading": thing.heading,
        "pitch": thing.pitch,
    }


def to_share(value: float) -> float | None:
    """Return a share with three decimals; None where it is not represented."""
    return None if isnan(value) else round(value, 3)
