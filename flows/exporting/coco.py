"""COCO: one ``annotations.json`` with masks of the classes and of the objects in each frame, and the pictures.

A mask is an uncompressed run-length code, column by column, as COCO counts it. Category ids are our class codes plus 1,
because trainers take 0 for "nothing". A class is no set of objects: where it appears in several places it is still one
mask (``iscrowd`` 1). Boxes are x, y, width, height in pixels, from the picture's upper left corner.

Parked cars, lamps, signs, bollards, bins and the letter box of the built-in street are objects. Each has a mask and a
box of its own (``iscrowd`` 0, categories from 101 on), ``instance_id``, ``visibility``, ``truncation`` (null where too
little of it is seen). ``objects`` has their 3D boxes in the world, each image its ``T_world_camera``, and ``camera`` is
that of all images, with its lens and shutter.

Format: https://cocodataset.org/#format-data
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from catalogs.scenes import load_scene, scene_identity
from catalogs.scenes.street import load_street_layout
from flows.exporting.camera import describe_camera
from flows.exporting.dataset import ExportedDataset
from flows.exporting.json_array import open_array
from tasks.conventions import SemanticClass
from tasks.render.contact_sheet import encode_png
from tasks.render.instances import InstanceFinder, Instances
from tasks.scene.street.objects import KINDS, StreetObject, list_objects, own_gaussians

FIRST_KIND = 100
"""Category ids of objects begin after it [1]; those of classes lie below."""
STREET = "street"


def write_coco(dataset: ExportedDataset, folder: Path) -> None:
    """Write ``annotations.json`` and ``images/``.

    Parameters
    ----------
    dataset : with frames
    folder : empty
    """
    (folder / "images").mkdir()
    images: list[dict[str, Any]] = []
    count = 0
    scene = find_scene_objects(dataset)
    with (folder / "annotations.json").open("w") as stream:
        stream.write('{"annotations": ')
        with open_array(stream) as annotations:
            for clip in dataset:
                classes, poses = clip.read_array("class"), clip.T_world_camera
                depth = clip.read_array("depth") if scene else None
                for frame, picture in enumerate(clip.read_array("rgb")):
                    name = f"{clip.name}_{frame:06d}.png"
                    (folder / "images" / name).write_bytes(encode_png(picture))
                    images.append(
                        _describe_image(len(images) + 1, name, clip.label, frame, picture)
                        | {"T_world_camera": poses[frame].tolist()}
                    )
                    masks = [
                        describe_mask(classes[frame] == kind, kind)
                        for kind in np.unique(classes[frame]).tolist()
                    ]
                    if scene is not None and depth is not None:
                        found = scene.finder.find(depth[frame], classes[frame], clip.camera.K, poses[frame])
                        masks += describe_instances(found, scene.objects)
                    for mask in masks:
                        count += 1
                        annotations.append({"id": count, "image_id": len(images)} | mask)
        categories = [{"id": kind + 1, "name": kind.name.lower()} for kind in SemanticClass]
        if scene is not None:
            categories += [
                {"id": FIRST_KIND + 1 + place, "name": kind, "supercategory": "object"}
                for place, kind in enumerate(KINDS)
            ]
        rest = {
            "camera": describe_camera(dataset.camera),
            "images": images,
            "categories": categories,
            "info": {"description": f"muSync {dataset.name}", "version": dataset.manifest["run_id"]},
            "licenses": [],
        } | ({} if scene is None else {"objects": [describe_object(thing) for thing in scene.objects]})
        stream.write(f", {json.dumps(rest, allow_nan=False)[1:]}")


def describe_mask(mask: NDArray[np.bool_], kind: int) -> dict[str, Any]:
    """Return category, run lengths, area and box of a mask.

    Parameters
    ----------
    mask : [H, W], with a pixel at least
    kind : class
    """
    column_by_column = mask.ravel(order="F")
    ends = np.flatnonzero(np.diff(column_by_column)) + 1
    runs = np.diff(np.concatenate(([0], ends, [mask.size]))).tolist()
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    box = [columns[0], rows[0], columns[-1] - columns[0] + 1, rows[-1] - rows[0] + 1]
    return {
        "category_id": kind + 1,
        # the first run is of pixels outside
        "segmentation": {"size": list(mask.shape), "counts": [0, *runs] if column_by_column[0] else runs},
        "area": int(mask.sum()),
        "bbox": [int(value) for value in box],
        "iscrowd": 1,
    }


def describe_instances(found: Instances, objects: Sequence[StreetObject]) -> list[dict[str, Any]]:
    """Return mask, box, visibility and truncation of every object of a frame.

    Parameters
    ----------
    found : in the frame
    objects : of the scene, in the order of their numbers
    """
    return [
        describe_mask(found.pixels == number, FIRST_KIND + KINDS.index(objects[number - 1].kind))
        | {
            "iscrowd": 0,
            "instance_id": number,
            "visibility": to_share(visibility),
            "truncation": to_share(found.truncation[number]),
        }
        for number, visibility in found.visibility.items()
    ]


def _describe_image(
    number: int, name: str, label: str, frame: int, picture: NDArray[np.uint8]
) -> dict[str, Any]:
    height, width = picture.shape[:2]
    return {
        "id": number, "file_name": f"images/{name}", "height": height, "width": width, "clip": label, "frame": frame
    }  # fmt: skip


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
