"""pycocotools gives back the class picture; without it the run lengths are decoded here."""

import json

import cv2
import numpy as np
import pytest

from flows.exporting.coco import describe_instances, describe_mask
from tasks.render.instances import Instances
from tasks.scene.street.objects import StreetObject
from tests.flows.exporting.conftest import BRAKING, HUMP


def decode_runs(segmentation):
    height, width = segmentation["size"]
    values = np.arange(len(segmentation["counts"])) % 2
    return np.repeat(values, segmentation["counts"]).reshape(width, height).T.astype(bool)


@pytest.mark.parametrize("corner", [True, False])
def test_runs_go_down_the_columns_and_begin_outside(corner):
    mask = np.zeros((3, 4), bool)
    mask[1, 1:3] = True
    mask[0, 0] = corner
    told = describe_mask(mask, 5)
    np.testing.assert_array_equal(decode_runs(told["segmentation"]), mask)
    assert told["area"] == 2 + corner
    assert told["bbox"] == ([0, 0, 3, 2] if corner else [1, 1, 2, 1])
    assert told["category_id"] == 6


def test_pycocotools_gives_back_pictures_and_classes(export, stored):
    module = pytest.importorskip("pycocotools.coco", reason="pip install pycocotools")
    read = module.COCO(str(export("coco") / "annotations.json"))
    assert len(read.imgs) == 22
    for image in read.imgs.values():
        clip = stored[image["clip"]]
        picture = cv2.imread(str(export("coco") / image["file_name"]))[..., ::-1]
        np.testing.assert_array_equal(picture, clip.pixels["rgb"][image["frame"]])
        classes = np.full(picture.shape[:2], 255)
        for annotation in read.imgToAnns[image["id"]]:
            mask = read.annToMask(annotation).astype(bool)
            assert mask.sum() == annotation["area"]
            classes[mask] = annotation["category_id"] - 1
        np.testing.assert_array_equal(classes, clip.pixels["class"][image["frame"]])
    assert {row["name"] for row in read.cats.values()} >= {"road", "building"}


def test_the_file_is_one_json_document(export):
    content = json.loads((export("coco") / "annotations.json").read_text())
    assert [image["clip"] for image in content["images"]] == [BRAKING] * 11 + [HUMP] * 11
    assert len({row["id"] for row in content["annotations"]}) == len(content["annotations"])


@pytest.fixture(scope="module")
def car_and_sign() -> tuple[np.ndarray, list]:
    """The picture of a car's corner and a sign, by number, and the annotations of both."""
    pixels = np.zeros((4, 6), np.int32)
    pixels[1:3, 2:5] = 2
    pixels[3, 0] = 1
    found = Instances(pixels=pixels, visibility={1: float("nan"), 2: 0.61249}, truncation={1: 0.5, 2: 0.0})
    box = {"centre": np.zeros(3), "size": np.ones(3), "heading": 0.0}
    things = [StreetObject(number=1, kind="car", **box), StreetObject(number=2, kind="sign", **box)]
    return pixels, describe_instances(found, things)


def test_an_object_has_its_own_mask_box_and_share_that_is_seen(car_and_sign):
    pixels, (car, sign) = car_and_sign
    np.testing.assert_array_equal(decode_runs(sign["segmentation"]), pixels == 2)
    assert (car["category_id"], sign["category_id"]) == (101, 103)
    assert (car["instance_id"], car["visibility"], car["truncation"], car["iscrowd"]) == (1, None, 0.5, 0)
    assert (sign["bbox"], sign["area"], sign["visibility"]) == ([2, 1, 3, 2], 6, 0.612)
