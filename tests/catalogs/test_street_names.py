"""Streets of a kind and a seed: their names, their forms in a grid, and the split that follows from the seed."""

import pytest

from catalogs.grids import build_grid
from catalogs.scenes import find_recipe, is_built_in, load_route, write_scene
from catalogs.scenes.street import STREET_FILE, load_street_layout
from catalogs.street_names import KINDS, find_default_split, parse_street_name
from tasks.errors import InputError
from tests.toy_street import toy_street


def grid_of(tmp_path, text: str):
    path = tmp_path / "grid.yaml"
    return build_grid(f"name: streets\n{text}".encode(), path)


def test_kind_and_seed_are_the_name_of_a_scene():
    assert {"town", "village", "avenue", "country", "industrial"} <= set(KINDS)
    street = parse_street_name("town-7")
    assert street is not None and (street.kind, street.seed) == ("town", 7)
    for other in ("street", "town", "town-07", "town--7", "moon-7", "town-1000000", "scenes/town-7"):
        assert parse_street_name(other) is None
    assert is_built_in("town-7") and is_built_in("hill") and not is_built_in("town-x")


def test_a_grid_names_a_street_by_kind_and_seed(tmp_path):
    grid = grid_of(tmp_path, "scene: {street: {kind: town, seed: 7}}\nscenarios: {a: {}}\n")
    assert grid.settings.scene == "town-7"
    assert grid.scenarios[0][1].scene is None


def test_an_axis_lists_streets_and_every_other_clip_has_the_grid_s_own(tmp_path):
    text = "axes: {street: {streets: {kind: [town, country], seed: {min: 7, max: 9}}}}\n"
    grid = grid_of(tmp_path, text)
    assert [scenario.scene for _, scenario in grid.scenarios] == [
        f"{kind}-{seed}" for kind in ("town", "country") for seed in (7, 8, 9)
    ]
    mixed = grid_of(tmp_path, "scenarios: {a: {scene: {street: {kind: town, seed: 7}}}, b: {}}\n")
    assert [scenario.scene for _, scenario in mixed.scenarios] == ["town-7", "street"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "scene: {street: {kind: moon, seed: 7}}\nscenarios: {a: {}}\n",
            "kind must be of .*town.*; it is .?moon",
        ),
        ("scene: {street: {kind: town}}\nscenarios: {a: {}}\n", "must be {street: {kind"),
        ("scene: {street: {kind: town, seed: -1}}\nscenarios: {a: {}}\n", "seed must be whole numbers"),
        ("axes: {s: {streets: {kind: town, seed: {min: 3, max: 1}}}}\n", "seed must be whole numbers"),
    ],
)
def test_a_faulty_street_is_one_sentence(tmp_path, text, told):
    with pytest.raises(InputError, match=told):
        grid_of(tmp_path, text)


def test_the_split_follows_from_the_seed_and_splits_of_the_grid_overrule_it(tmp_path):
    assert [find_default_split(f"town-{seed}") for seed in range(5)] == ["train"] * 3 + ["val", "test"]
    assert find_default_split("town-13") == "val" and find_default_split("street") == "train"
    streets = "axes: {s: {streets: {kind: town, seed: {min: 2, max: 4}}}}\n"
    assert [split for split, _ in grid_of(tmp_path, streets).tags] == ["train", "val", "test"]
    own = streets + "splits: {mine: {scene: [town-3]}, rest: {}}\n"
    assert [split for split, _ in grid_of(tmp_path, own).tags] == ["rest", "mine", "rest"]
    assert grid_of(tmp_path, "scenarios: {a: {}}\n").tags[0][0] == ""


@pytest.mark.parametrize("kind", KINDS)
def test_a_seed_draws_every_range_of_its_kind_again(kind):
    layouts = []
    for seed in (1, 1, 2):
        changes, drawn = find_recipe(f"{kind}-{seed}")
        layouts.append(load_street_layout(STREET_FILE, *changes, seed=drawn))
    assert layouts[0] == layouts[1] != layouts[2]


def test_a_route_is_that_of_the_scene_without_its_gaussians(monkeypatch, tmp_path):
    write_scene(toy_street(), tmp_path / "toy", {})
    assert load_route(str(tmp_path / "toy")).length == toy_street().route.length
    monkeypatch.setattr("catalogs.scenes.cached_street", None)
    assert load_route("town-7").length == 180.0
