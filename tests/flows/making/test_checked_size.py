"""From the height of the gate file on, a clip is checked by pictures of half the size and a camera to match."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from catalogs.entries import load
from flows.making import gate
from tasks.errors import InputError

CAMERA = load("camera", "dashcam-1280x720")
CATALOGUE = SimpleNamespace(
    gates=load("gate file"),
    scene=SimpleNamespace(
        route=SimpleNamespace(pose=lambda station: np.tile(np.eye(4), (len(station), 1, 1)))
    ),
)


@pytest.mark.parametrize(("height", "share"), [(718, 1), (720, 2)])
def test_pictures_of_720_rows_are_checked_at_half_size(monkeypatch, height, share):
    shape, given = (2, height, 8), []

    def keep(buffers, camera, **_):
        given.append((buffers["depth"].shape, camera.K[0, 0]))
        raise InputError("enough")

    monkeypatch.setattr(gate, "prepare_clip", keep)
    buffers = {
        "rgb": np.zeros((*shape, 3), np.uint8),
        "depth": np.ones(shape, np.float32),
        "class": np.zeros(shape, np.uint8),
    }
    frames = {"t_ns": np.array([0, 100_000_000]), "station": np.array([0.0, 1.0])}
    with pytest.raises(InputError, match="enough"):
        gate.judge_motion(buffers, frames, 0.0, CATALOGUE, replace(CAMERA, width=8, height=height))
    assert given == [((2, height // share, 8 // share), CAMERA.K[0, 0] / share)]
