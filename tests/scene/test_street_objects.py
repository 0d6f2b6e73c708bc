"""Objects of the built-in street: each Gaussian has its owner, lies in its box, and belongs to one object."""

from dataclasses import replace

import numpy as np
import pytest

from catalogs.scenes.street import load_street_layout
from tasks.conventions import SemanticClass
from tasks.errors import InputError
from tasks.scene.street.bend import integrate_course
from tasks.scene.street.cars.parked import list_cars
from tasks.scene.street.furniture import build_furniture
from tasks.scene.street.objects import KINDS, list_objects, own_gaussians
from tasks.scene.street.plan import plan_street
from tests.toy_street import toy_street

SHORT = replace(load_street_layout(), route_length=12.0, behind=5.0, beyond=20.0, crossing_station=4.0)
CLASS = {"car": SemanticClass.VEHICLE, "bin": SemanticClass.OTHER, "letter box": SemanticClass.OTHER}


def test_every_gaussian_of_an_object_lies_in_its_box_and_has_its_class() -> None:
    plan, line = plan_street(SHORT, 7), integrate_course(SHORT)
    objects, owners, classes = list_objects(SHORT, 7)
    built = [*list_cars(plan.cars, 7), build_furniture(SHORT, plan, 7)]
    points = np.concatenate([line.to_world(surfels.centre) for surfels in built])
    assert len(points) == len(owners) and {thing.kind for thing in objects} == set(KINDS)
    for number, thing in enumerate(objects, start=1):
        assert thing.number == number
        own = points[owners == number] - thing.centre
        cos, sin = np.cos(thing.heading), np.sin(thing.heading)
        local = np.column_stack(
            [own[:, 0] * cos + own[:, 1] * sin, own[:, 1] * cos - own[:, 0] * sin, own[:, 2]]
        )
        reach = np.abs(local).max(axis=0)
        assert np.all(reach <= thing.size / 2 + 0.01) and np.all(reach >= thing.size / 2 - 0.25)
        assert set(classes[owners == number]) == {CLASS.get(thing.kind, SemanticClass.POLE)}
    bollard = next(thing for thing in objects if thing.kind == "bollard")
    assert bollard.size == pytest.approx(
        [0.1, 0.1, 0.9], abs=0.02
    )  # to the edge of its surface, not of its middles
    cars = [thing for thing in objects if thing.kind == "car"]
    assert [round(np.cos(thing.heading)) for thing in cars] == [car.facing for car in plan.cars]


def test_the_last_gaussians_of_a_scene_are_those_of_the_objects() -> None:
    cloud = toy_street().gaussians
    tail = cloud.class_id[-3:]
    assert own_gaussians(cloud, np.array([1, 1, 2], np.int32), tail).tolist()[-4:] == [0, 1, 1, 2]
    with pytest.raises(InputError, match="last Gaussians are other objects"):
        other = replace(cloud, class_id=np.zeros_like(cloud.class_id))
        own_gaussians(other, np.array([1, 1, 2], np.int32), tail)
