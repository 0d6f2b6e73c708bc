"""A cloud that the rasteriser cannot draw is refused, with every fault named."""

from dataclasses import replace

import numpy as np
import pytest

from tasks.errors import InputError
from tasks.scene.gaussians import check_gaussians
from tests.render.clouds import random_cloud

SOUND = random_cloud(8)


def test_a_sound_cloud_passes():
    check_gaussians(SOUND)


def test_double_precision_is_refused_by_name():
    wrong = replace(SOUND, means=SOUND.means.astype(np.float64), class_id=SOUND.class_id.astype(np.int64))
    with pytest.raises(InputError) as refusal:
        check_gaussians(wrong, "cloud")
    assert "cloud: means must be float32; it is float64" in str(refusal.value)
    assert "cloud: class_id must be uint8; it is int64" in str(refusal.value)


@pytest.mark.parametrize("name", ["means", "quats_wxyz", "scales", "opacities", "sh", "normals"])
def test_the_first_gaussian_that_is_no_number_is_named(name):
    broken = getattr(SOUND, name).copy()
    broken[5:7] = np.nan
    with pytest.raises(
        InputError, match=f"{name} must be finite; 2 of 8 Gaussians are not, the first is number 5"
    ):
        check_gaussians(replace(SOUND, **{name: broken}))


def test_no_opacity_and_no_extent_are_refused_together():
    opacities, scales = SOUND.opacities.copy(), SOUND.scales.copy()
    opacities[2], scales[3, 1] = 0, -1
    with pytest.raises(InputError) as refusal:
        check_gaussians(replace(SOUND, opacities=opacities, scales=scales))
    assert "opacities must be in (0, 1]" in str(refusal.value) and "scales must be positive" in str(
        refusal.value
    )
