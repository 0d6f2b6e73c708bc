"""Why two datasets differ: down to the value, and only inputs that can reach what changed."""

from typing import Any

from manifests.explain import ABSENT, find_input_differences, find_reasons, find_value_differences


def manifest(**changes: Any) -> dict[str, Any]:
    plain = {
        "inputs": {"vehicle.yaml": "v1", "weather/snow.yaml": "s1"}, "scene": {"sha256": "x"}, "backend": "cpu",
        "grid": {"vehicle_mode": "paper", "frames": 81, "frame_rate_hz": 10, "seed": 1},
        "made_with": {"code": {"version": "1"}, "libraries": {"numpy": "2"}}, "processor": {"model": "p"},
    }  # fmt: skip
    return plain | changes


def test_equal_manifests_have_nothing_to_explain() -> None:
    assert find_input_differences(manifest(), manifest(), {}, {}) == []


def test_a_changed_vehicle_is_named_to_the_value() -> None:
    a = {"vehicle.yaml": b"brake_gain: {value: 1000, unit: N}\nfamilies: {dry: {value: [1, 2]}}"}
    b = {"vehicle.yaml": b"brake_gain: {value: 1100, unit: N}\nfamilies: {dry: {value: [1, 3]}}\nfade: 0.1"}
    other = manifest(inputs={"vehicle.yaml": "v2", "weather/snow.yaml": "s1"})
    rows = find_input_differences(manifest(), other, a, b)
    assert [(row["path"], row["a"], row["b"]) for row in rows] == [
        ("brake_gain.value", 1000, 1100), ("fade", ABSENT, 0.1), ("families.dry.value.1", 2, 3),
    ]  # fmt: skip
    assert {row["input"] for row in rows} == {"vehicle.yaml"}


def test_an_input_is_a_reason_only_where_it_can_reach() -> None:
    look = manifest(inputs={"vehicle.yaml": "v1", "weather/snow.yaml": "s2"})
    files = {"weather/snow.yaml": b"a: 1"}, {"weather/snow.yaml": b"a: 2"}
    rows = find_input_differences(manifest(), look, *files)
    assert find_reasons(["rgb"], rows) == ["weather/snow.yaml"]
    assert find_reasons(["rgb", "ticks"], rows) == [], "a look cannot move the car"


def test_every_group_of_the_manifest_is_looked_at() -> None:
    changed = manifest(
        scene={"sha256": "y"}, backend="gsplat",
        grid={"vehicle_mode": "coupled", "frames": 5, "frame_rate_hz": 16, "seed": 2},
        made_with={"code": {"version": "2"}, "libraries": {"numpy": "3"}}, processor={"model": "q"},
    )  # fmt: skip
    assert [row["input"] for row in find_input_differences(manifest(), changed, {}, {})] == [
        "scene", "backend", "vehicle_mode", "frames", "frame_rate_hz", "seed", "code", "libraries", "processor",
    ]  # fmt: skip


def test_lists_of_other_lengths_and_other_kinds_are_one_difference() -> None:
    assert find_value_differences({"x": [1, 2]}, {"x": [1]}) == [("x", [1, 2], [1])]
    assert find_value_differences({"x": {"y": 1}}, {"x": 3}) == [("x", {"y": 1}, 3)]
