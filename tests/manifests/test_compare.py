import numpy as np

from manifests.compare import find_pixel_difference, find_row_difference


def table() -> dict[str, np.ndarray]:
    return {"t_ns": np.arange(100), "speed": np.linspace(20, 0, 100), "pitch": np.full(100, np.nan)}


def test_equal_tables_have_no_difference_even_with_nan():
    assert find_row_difference(table(), table(), ["t_ns", "speed", "pitch"]) is None


def test_the_earliest_tick_wins_over_the_channel_order():
    remade = table()
    remade["t_ns"][60] += 1
    remade["speed"][40] = np.nextafter(remade["speed"][40], 99)
    found = find_row_difference(table(), remade, ["t_ns", "speed", "pitch"])
    assert found is not None
    assert (found["channel"], found["tick"]) == ("speed", 40)


def test_nan_that_became_a_number_is_a_difference():
    remade = table()
    remade["pitch"][7] = 0.0
    found = find_row_difference(table(), remade, ["pitch"])
    assert found is not None and found["tick"] == 7


def test_what_the_hashes_tell_apart_is_a_difference_though_numbers_compare_equal():
    recorded, remade = np.zeros((2, 3, 4)), np.zeros((2, 3, 4))
    remade[1, 2, 3] = -0.0
    found = find_row_difference({"pitch": recorded[1, 2]}, {"pitch": remade[1, 2]}, ["pitch"])
    assert found is not None and (found["tick"], np.signbit(found["remade"])) == (3, True)
    pixel = find_pixel_difference("depth", recorded, remade)
    assert pixel is not None and (pixel["tick"], pixel["pixel"]) == (1, [3, 2])
    single = find_row_difference({"pitch": recorded[0]}, {"pitch": recorded[0].astype(np.float32)}, ["pitch"])
    assert single is not None and single["remade"] == "shape (3, 4) of float32"


def test_a_missing_channel_and_a_shorter_table_are_differences():
    short = {name: values[:50] for name, values in table().items()}
    assert find_row_difference(table(), short, ["t_ns"])["recorded"] == "shape (100,) of int64"  # type: ignore[index]
    assert find_row_difference(table(), {}, ["t_ns"])["remade"] == "absent"  # type: ignore[index]


def test_one_changed_pixel_is_named_by_frame_column_and_row():
    recorded = np.zeros((4, 6, 8, 3), np.uint8)
    remade = recorded.copy()
    remade[2, 5, 3, 1] = 1
    found = find_pixel_difference("rgb", recorded, remade)
    assert found is not None
    assert (found["tick"], found["pixel"], found["remade"]) == (2, [3, 5], [0, 1, 0])
    assert find_pixel_difference("rgb", recorded, recorded.copy()) is None


def test_text_differs_by_what_it_says():
    recorded = {"label": np.array(["dry", "rain", "snow"], object)}
    remade = {"label": np.array(["dry", "rain", "ice"], object)}
    found = find_row_difference(recorded, remade, ["label"])
    assert found == {"channel": "label", "tick": 2, "recorded": "snow", "remade": "ice"}
    assert find_row_difference(recorded, dict(recorded), ["label"]) is None
