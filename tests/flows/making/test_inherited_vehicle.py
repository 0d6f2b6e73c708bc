"""A dataset of a vehicle that extends another one keeps all of the car, and its clips are of all of the car."""

from catalogs.entries import load
from flows.making.plan import make_plan
from manifests.explain import find_input_differences


def test_the_copy_in_a_dataset_is_whole_and_a_change_of_the_other_vehicle_changes_the_clips(tmp_path):
    base, car = tmp_path / "base.yaml", tmp_path / "car.yaml"
    text = "extends: paper-reference\nsprung_mass: {{value: {}, unit: kg, source: scales}}\n"
    base.write_text(text.format(1500))
    car.write_text("extends: base.yaml\n")
    plan, inputs = make_plan("demo", "cpu", str(car), pictures=False)
    kept = tmp_path / "inputs" / "car.yaml"
    kept.parent.mkdir()
    kept.write_bytes(inputs["vehicle.yaml"])
    assert load("vehicle", kept) == load("vehicle", car)
    assert not [name for name in inputs if "base" in name]
    base.write_text(text.format(1600))
    other, others = make_plan("demo", "cpu", str(car), pictures=False)
    assert {clip.clip_id for clip in plan.clips}.isdisjoint(clip.clip_id for clip in other.clips)
    (row,) = find_input_differences(plan.as_json(), other.as_json(), inputs, others)
    assert (row["input"], row["path"], row["a"], row["b"]) == (
        "vehicle.yaml",
        "sprung_mass.value",
        1500,
        1600,
    )
