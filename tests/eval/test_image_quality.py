"""PSNR and SSIM against closed forms and a slow, independent writing-out of the definition."""

import numpy as np
import pytest

from studies.synthetic_street import Clip
from tasks.errors import InputError
from tasks.eval.image_quality import psnr, ssim


@pytest.fixture
def pair(hump_clip: Clip) -> tuple[np.ndarray, np.ndarray]:
    picture = hump_clip.frames[0][40:90, 60:130]
    noisy = np.clip(picture + np.random.default_rng(0).normal(0, 12, picture.shape), 0, 255).astype(np.uint8)
    return picture, noisy


def slow_ssim(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Wang et al. 2004, eqs. 13 to 16, window by window."""
    x, y = (p.astype(float) @ [0.299, 0.587, 0.114] for p in (x, y))
    d = np.arange(-5, 6)
    w = np.exp(-(d[:, None] ** 2 + d[None] ** 2) / (2 * 1.5**2))
    w /= w.sum()
    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    out = np.zeros((x.shape[0] - 10, x.shape[1] - 10))
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            a, b = x[i : i + 11, j : j + 11], y[i : i + 11, j : j + 11]
            ma, mb = (w * a).sum(), (w * b).sum()
            va, vb, cov = (
                (w * (a - ma) ** 2).sum(),
                (w * (b - mb) ** 2).sum(),
                (w * (a - ma) * (b - mb)).sum(),
            )
            out[i, j] = (2 * ma * mb + c1) * (2 * cov + c2) / ((ma**2 + mb**2 + c1) * (va + vb + c2))
    return out


def test_ssim_is_its_definition_written_out(pair: tuple[np.ndarray, np.ndarray]) -> None:
    expected = slow_ssim(*pair)
    assert 0.2 < expected.mean() < 0.98
    assert ssim(*pair) == pytest.approx(expected.mean(), abs=1e-9)
    region = np.zeros(pair[0].shape[:2], bool)
    region[20:40, 3:30] = True
    assert ssim(*pair, region) == pytest.approx(expected[15:35, :25].mean(), abs=1e-9)


def test_two_flat_pictures_differ_by_luminance_alone() -> None:
    a, b = np.full((20, 20), 100, np.uint8), np.full((20, 20), 150, np.uint8)
    c1 = (0.01 * 255) ** 2
    assert ssim(a, b) == pytest.approx((2 * 100 * 150 + c1) / (100**2 + 150**2 + c1), abs=1e-9)
    assert psnr(a, b) == pytest.approx(20 * np.log10(255 / 50))


def test_equal_pictures_are_perfect(pair: tuple[np.ndarray, np.ndarray]) -> None:
    assert ssim(pair[0], pair[0]) == pytest.approx(1.0) and psnr(pair[0], pair[0]) == np.inf


def test_psnr_of_one_grey_level_is_48_13_db() -> None:
    a = np.full((4, 5, 3), 7, np.uint8)
    assert psnr(a, a + np.uint8(1)) == pytest.approx(48.1308, abs=1e-4)


def test_a_region_sees_only_itself(pair: tuple[np.ndarray, np.ndarray]) -> None:
    half = pair[0].copy()
    half[:, :35] = 255 - half[:, :35]
    right = np.zeros(half.shape[:2], bool)
    right[:, 41:] = True
    assert psnr(pair[0], half, right) == np.inf and ssim(pair[0], half, right) == pytest.approx(1.0)
    assert psnr(pair[0], half, ~right) < 20 and ssim(pair[0], half, ~right) < 0.5


def test_more_noise_is_worse(pair: tuple[np.ndarray, np.ndarray]) -> None:
    rng = np.random.default_rng(1)
    scores = []
    for sigma in (2, 6, 18):
        noisy = np.clip(pair[0] + rng.normal(0, sigma, pair[0].shape), 0, 255).astype(np.uint8)
        scores.append((psnr(pair[0], noisy), ssim(pair[0], noisy)))
    assert scores == sorted(scores, reverse=True)


def test_unfit_pictures_are_refused() -> None:
    a = np.zeros((20, 20, 3), np.uint8)
    with pytest.raises(InputError) as caught:
        psnr(a, a[:10].astype(float), np.zeros((20, 20), bool))
    assert len(caught.value.problems) == 3
    with pytest.raises(InputError, match="11 x 11"):
        ssim(a[:8], a[:8])
    edge = np.zeros((20, 20), bool)
    edge[0] = True
    with pytest.raises(InputError, match="inside"):
        ssim(a, a, edge)
