"""What `scene check` finds: nothing in a sound street, and each fault that is put into one."""

from dataclasses import fields, replace

import numpy as np
import pytest

from catalogs.scenes import write_scene
from flows.making.scene_views import check_scene, check_scenes, compare_streets, show_scenes
from tasks.conventions import ROAD_CLASSES, SemanticClass
from tasks.errors import InputError
from tasks.scene.gaussians import Gaussians
from tasks.scene.scene import Scene
from tasks.scene.soundness import find_faults, measure_soundness
from tests.toy_street import toy_street


def keep(scene: Scene, kept: np.ndarray) -> Scene:
    cloud = scene.gaussians
    parts = {
        f.name: value[kept]
        for f in fields(Gaussians)
        if isinstance(value := getattr(cloud, f.name), np.ndarray)
    }
    return replace(scene, gaussians=replace(cloud, **parts))


def move(scene: Scene, chosen: np.ndarray, by: tuple[float, float, float]) -> Scene:
    means = scene.gaussians.means + np.where(chosen[:, None], np.float32(by), np.float32(0))
    return replace(scene, gaussians=replace(scene.gaussians, means=means.astype(np.float32)))


def faults_of(scene: Scene) -> list[str]:
    return find_faults(measure_soundness(scene), 0.2)


@pytest.fixture(scope="module")
def street() -> Scene:
    return toy_street()


def test_a_sound_street_has_no_fault(street):
    row, _ = check_scene(street, 0.2, "cpu")
    assert row["faults"] == [] and row["holes"] == 0


def test_each_fault_is_told(street):
    x, y = street.gaussians.means[:, 0], street.gaussians.means[:, 1]
    road = np.isin(street.gaussians.class_id, ROAD_CLASSES)
    (told,) = faults_of(keep(street, ~(road & (x > 10) & (x < 16))))
    assert told.startswith("road must lie below")
    assert any("is 0.30 m off" in fault for fault in faults_of(move(street, road, (0, 0, 0.3))))
    wall = ~road & (y > 0) & (np.abs(x - 20) < 1)
    (told,) = faults_of(move(street, wall, (0, -4.2, 0)))
    assert told.startswith("nothing may stand where the car drives")
    few = np.zeros(len(x), bool)
    few[np.flatnonzero(~road)[::40]] = True
    scattered = move(street, few, (0, 0, 30.0))
    assert any("float without neighbours" in fault for fault in faults_of(scattered))
    assert any("check the scale" in fault for fault in faults_of(replace(street, carriageway_left=80.0)))
    (told,) = find_faults(measure_soundness(street), -1.0)
    assert told.startswith("the grade must be at most")


@pytest.mark.parametrize(("beyond", "told"), [(0.0, True), (40.0, False)])
def test_vehicles_have_a_height_beside_the_route_and_none_beyond_its_end(street, beyond, told):
    road, x = np.isin(street.gaussians.class_id, ROAD_CLASSES), street.gaussians.means[:, 0]
    cars = ~road & (np.abs(x - 20) < 1)
    classes = np.where(cars, np.uint8(SemanticClass.VEHICLE), street.gaussians.class_id)
    parked = replace(street, gaussians=replace(street.gaussians, class_id=classes))
    reach = beyond + street.route.length * (beyond > 0)
    assert any("vehicles are" in fault for fault in faults_of(move(parked, cars, (reach, 0, 8.0)))) == told


def test_a_hole_in_the_picture_of_the_road_is_told(street):
    x = street.gaussians.means[:, 0]
    row, _ = check_scene(keep(street, (x < 14) | (x > 19)), 0.2, "cpu")
    assert any("may be holes" in fault for fault in row["faults"])


def test_streets_are_compared_by_place_and_a_twin_is_the_one_most_like():
    rng = np.random.default_rng(1)
    grains = np.repeat(rng.random((3, 2, 1, 4, 6, 3)), 2, axis=2)
    grains[:, :, 1] += 0.01
    grains[2] = grains[0] + 0.002
    ratio, other = compare_streets(grains)
    assert other.tolist() == [2, 0, 0] or other.tolist() == [2, 2, 0]
    assert ratio[0] == pytest.approx(0.2) and ratio[1] > 10


def test_scenes_are_checked_and_shown_by_name_or_folder(tmp_path):
    folders = []
    for seed in (1, 2):
        write_scene(toy_street(seed), tmp_path / f"toy-{seed}", {})
        folders.append(str(tmp_path / f"toy-{seed}"))
    result = check_scenes(folders, out=str(tmp_path / "check"), backend="cpu")
    assert result["sound"] and result["faults"] == 0 and result["least_ratio"] > 0
    assert [row["most_like"] for row in result["scenes"]] == folders[::-1]
    assert (tmp_path / "check" / "check.json").is_file()
    shown = show_scenes(folders[:1], out=str(tmp_path / "sheet"), backend="cpu")
    assert shown["scenes"] == 1 and (tmp_path / "sheet" / "gallery.png").stat().st_size > 10_000
    with pytest.raises(InputError, match="streets must be 1 or more"):
        check_scenes(streets=0)
