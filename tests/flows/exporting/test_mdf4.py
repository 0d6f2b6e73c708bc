"""asammdf gives back every channel with its unit, on our time."""

import numpy as np
import pytest

from tasks.conventions import TICK_CHANNELS
from tests.flows.exporting.conftest import BRAKING, HUMP

asammdf = pytest.importorskip("asammdf", reason="pip install 'musync-gs[export]'")


def test_every_tick_and_pose_reads_back_with_unit_and_meaning(export, stored):
    files = sorted(export("mdf4").glob("*.mf4"))
    for path, label in zip(files, (BRAKING, HUMP), strict=True):
        clip = stored[label]
        with asammdf.MDF(path) as read:
            assert read.version.startswith("4.")
            for channel in TICK_CHANNELS:
                signal = read.get(channel.name)
                np.testing.assert_array_equal(signal.samples, clip.ticks[channel.name], channel.name)
                np.testing.assert_array_equal(signal.timestamps, clip.ticks["t_ns"] / 1e9)
                assert (signal.unit, signal.comment) == (channel.unit, channel.description)
            pose = np.stack([read.get(f"T_world_rig_{k // 4}{k % 4}").samples for k in range(16)], axis=1)
            np.testing.assert_array_equal(pose.reshape(-1, 4, 4), clip.T_world_rig)
            np.testing.assert_array_equal(read.get("frame").timestamps, clip.frames["t_ns"] / 1e9)
    with asammdf.MDF(files[0]) as read:
        assert read.get("pitch").samples[-1] > 0.001  # nose down while braking
