"""Objects of the built-in street in a dataset's frames: found from depth, class and pose; no dataset stores them."""

from dataclasses import dataclass
from math import isnan
from typing import Any

from catalogs.scenes import load_scene, scene_identity
from catalogs.scenes.street import load_street_layout
from flows.exporting.dataset import ExportedDataset
from tasks.render.instances import InstanceFinder
from tasks.scene.street.objects import StreetObject, list_objects, own_gaussians

STREET = "street"


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


def find_scene_objects(dataset: ExportedDataset) -> SceneObjects | None:
    """Return the objects of the dataset's scene.

    None where they are not known, or not to be found in its pictures: of every scene but the built-in street of this
    version, with a lens that distorts, and with a shutter that takes the rows one after the other.

    Parameters
    ----------
    dataset : with frames
    """
    scene, camera = dataset.plan.scene, dataset.camera
    if scene["name"] != STREET or camera.distortion is not None or camera.line_delay_s or camera.motion_blur:
        return None
    if scene["sha256"] != scene_identity(STREET):
        return None
    objects, owners, classes = list_objects(load_street_layout())
    cloud = load_scene(STREET).gaussians
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
    }


def to_share(value: float) -> float | None:
    """Return a share with three decimals; None where it is not represented."""
    return None if isnan(value) else round(value, 3)
