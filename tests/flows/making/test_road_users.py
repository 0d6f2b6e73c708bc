"""Road users that cannot be where a grid has them: a sentence each, all at once."""

import pytest

from flows.making.plan import make_plan
from tasks.errors import InputError
from tests.toy_street import write_toy_grid

GRID = """\
name: odd
scene: {folder}/scene
camera: {folder}/camera.yaml
frames: 6
frame_rate_hz: 10
scenarios:
  wall: {{objects: [{{kind: car, track: {{station_m: 15, lateral_m: 2, heading_deg: 90, speed_km_h: 30}}}}]}}
  twice:
    objects:
      - {{kind: car, track: {{gap_m: 10}}}}
      - {{kind: adult, track: {{gap_m: 11}}}}
  behind: {{objects: [{{kind: van, track: {{station_m: 1}}}}]}}
  away: {{objects: [{{kind: car, track: {{station_m: 39, speed_km_h: 90}}}}]}}
"""


def test_every_road_user_that_stands_or_drives_where_it_cannot_is_named(tmp_path):
    with pytest.raises(InputError) as told:
        make_plan(write_toy_grid(tmp_path, GRID), "cpu")
    sentences = "\n".join(told.value.problems)
    assert len(told.value.problems) == 4, sentences
    for label, words in {
        "wall": "object 1 (car) must keep clear of the street; at 0",
        "twice": "object 1 (car) and object 2 (adult) must not be in one place; they are at 0 s",
        "behind": "object 1 (van) must not stand where the ego vehicle starts: begin farther ahead",
        "away": "object 1 (car) must stay on the route, 0 to 40.0 m",
    }.items():
        assert f"scenario {label}: {words}" in sentences
