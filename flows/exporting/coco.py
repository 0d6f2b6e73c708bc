"""COCO: one ``annotations.json`` with masks of the classes and of the objects in each frame, and the pictures.

A mask is an uncompressed run-length code, column by column, as COCO counts it. Category ids are our class codes plus 1,
because trainers take 0 for "nothing". A class is no set of objects: where it appears in several places it is still one
mask (``iscrowd`` 1). Boxes are x, y, width, height in pixels, from the picture's upper left corner.

Parked cars, lamps, signs, bollards, bins and the letter box of a street that muSync makes are objects. Each has a mask
and a box of its own (``iscrowd`` 0, categories from 101 on), ``instance_id``, ``visibility``, ``truncation`` (null
where too little of it is seen). Road users are objects in every scene, with instances from 10,001 on; their annotation
has box and velocity in the world (``centre``, ``size``, ``rotation`` wxyz, ``velocity``). ``objects`` has their 3D
boxes in the world, each image its ``T_world_camera``, and ``camera`` is that of all images, with its lens and shutter.
Images and objects name the scene where there are several.

Format: https://cocodataset.org/#format-data
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import isnan, nan
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from catalogs.scenes import find_recipe, load_scene, scene_identity
from catalogs.scenes.street import STREET_FILE, load_street_layout
from flows.exporting.camera import describe_camera
from flows.exporting.dataset import ExportedDataset
from flows.exporting.json_array import open_array
from flows.exporting.road_users import NAMES, list_objects_by_frame
from tasks.conventions import SemanticClass
from tasks.render.camera import Camera
from tasks.render.contact_sheet import encode_png
from tasks.render.instances import InstanceFinder, Instances
from tasks.scene.street.objects import KINDS, StreetObject, list_objects, own_gaussians

EVERY_KIND = (*KINDS, *(kind for kind in NAMES if kind not in KINDS))
"""Kinds of street objects, and then of road users."""
FIRST_ROAD_USER = 10_000
"""Numbers of the instances of road users begin after it [1]."""
FIRST_KIND = 100
"""Category ids of objects begin after it [1]; those of classes lie below."""


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
    objects: dict[str | None, tuple[StreetObject, ...]] = {}
    find_scene = lru_cache(maxsize=1)(
        lambda name: find_scene_objects(dataset.plan.record_of(name), dataset.camera)
    )
    with (folder / "annotations.json").open("w") as stream:
        stream.write('{"annotations": ')
        with open_array(stream) as annotations:
            for clip in dataset:
                classes, poses, named = clip.read_array("class"), clip.T_world_camera, clip.scenario.scene
                if (scene := find_scene(named)) is not None:
                    objects[named] = scene.objects
                depth = clip.read_array("depth") if scene else None
                instances = clip.read_array("instance") if clip.objects else None
                users = list_objects_by_frame(clip)
                for frame, picture in enumerate(clip.read_array("rgb")):
                    name = f"{clip.name}_{frame:06d}.png"
                    (folder / "images" / name).write_bytes(encode_png(picture))
                    images.append(
                        _describe_image(len(images) + 1, name, clip.label, frame, picture)
                        | {"T_world_camera": poses[frame].tolist()}
                        | ({"K": clip.camera.K.tolist()} if dataset.camera.varies else {})
                        | ({} if named is None else {"scene": named})
                    )
                    masks = [
                        describe_mask(classes[frame] == kind, kind)
                        for kind in np.unique(classes[frame]).tolist()
                    ]
                    if scene is not None and depth is not None:
                        # what moves is no part of the street
                        still = (
                            classes[frame] if instances is None else classes[frame] * (instances[frame] == 0)
                        )
                        found = scene.finder.find(depth[frame], still, clip.camera.K, poses[frame])
                        masks += describe_instances(found, scene.objects)
                    if instances is not None:
                        masks += describe_road_users(instances[frame], users[frame])
                    for mask in masks:
                        count += 1
                        annotations.append({"id": count, "image_id": len(images)} | mask)
        categories = [{"id": kind + 1, "name": kind.name.lower()} for kind in SemanticClass]
        if objects or dataset.plan.settings.has_objects:
            categories += [
                {"id": FIRST_KIND + 1 + index, "name": kind, "supercategory": "object"}
                for index, kind in enumerate(EVERY_KIND if dataset.plan.settings.has_objects else KINDS)
            ]
        rest: dict[str, Any] = {
            "camera": describe_camera(dataset.camera),
            "images": images,
            "categories": categories,
            "info": {"description": f"muSync {dataset.name}", "version": dataset.manifest["run_id"]},
            "licenses": [],
        }
        if objects:
            rest["objects"] = [
                describe_object(thing) | ({} if named is None else {"scene": named})
                for named, things in objects.items()
                for thing in things
            ]
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


def describe_road_users(
    instances: NDArray[np.uint16], rows: Sequence[Mapping[str, Any]]
) -> list[dict[str, Any]]:
    """Return mask, boxes, velocity, visibility and truncation of every road user that a frame shows.

    Parameters
    ----------
    instances : uint16 [H, W] of the frame
    rows : of its road users
    """
    return [
        describe_mask(instances == row["object"], FIRST_KIND + EVERY_KIND.index(row["kind"]))
        | {
            "iscrowd": 0,
            "instance_id": FIRST_ROAD_USER + row["object"],
            "visibility": to_share(nan if row["visibility"] is None else row["visibility"]),
            "truncation": to_share(row["truncation"]),
            "centre": row["centre_world"],
            "size": row["size"],
            "rotation": row["rotation_world"],
            "velocity": row["velocity_world"],
        }
        for row in rows
        if row["visible_pixels"]
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
