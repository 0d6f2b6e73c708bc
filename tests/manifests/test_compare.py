import numpy as np

from manifests.compare import first_pixel_difference, first_row_difference


def table() -> dict[str, np.ndarray]:
    return {"t_ns": np.arange(100), "speed": np.linspace(20, 0, 100), "pitch": np.full(100, np.nan)}


def test_equal_tables_have_no_difference_even_with_nan():
    assert first_row_difference(table(), table(), ["t_ns", "speed", "pitch"]) is None


def test_the_earliest_tick_wins_over_the_channel_order():
    remade = table()
    remade["t_ns"][60] += 1
    remade["speed"][40] = np.nextafter(remade["speed"][40], 99)
    found = first_row_difference(table(), remade, ["t_ns", "speed", "pitch"])
    assert found is not None
    assert (found["channel"], found["tick"]) == ("speed", 40)


def test_nan_that_became_a_number_is_a_difference():
    remade = table()
    remade["pitch"][7] = 0.0
    found = first_row_difference(table(), remade, ["pitch"])
    assert found is not None and found["tick"] == 7


def test_a_missing_channel_and_a_shorter_table_are_differences():
    short = {name: values[:50] for name, values in table().items()}
    assert first_row_difference(table(), short, ["t_ns"])["recorded"] == "shape (100,)"  # type: ignore[index]
    assert first_row_difference(table(), {}, ["t_ns"])["remade"] == "absent"  # type: ignore[index]


def test_one_changed_pixel_is_named_by_frame_column_and_row():
    recorded = np.zeros((4, 6, 8, 3), np.uint8)
    remade = recorded.copy()
    remade[2, 5, 3, 1] = 1
    found = first_pixel_difference("rgb", recorded, remade)
    assert found is not None
    assert (found["tick"], found["pixel"], found["remade"]) == (2, [3, 5], [0, 1, 0])
    assert first_pixel_difference("rgb", recorded, recorded.copy()) is None


def test_depth_with_nan_compares_equal_to_itself():
    depth = np.full((2, 3, 4), np.nan, np.float32)
    assert first_pixel_difference("depth", depth, depth.copy()) is None
