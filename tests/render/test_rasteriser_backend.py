"""Which rasteriser is taken, and that gsplat's picture is the CPU's."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tasks.errors import InputError
from tasks.render.rasterise import backend
from tasks.render.rasterise.backend import CpuBackend, compare_with_cpu, probe_scene, select_backend
from tasks.render.rasterise.front import find_front
from tasks.render.rasterise.gbuffer import GBuffer
from tasks.render.rasterise.rasteriser import prepare_gaussians, rasterise_view
from tests.render.clouds import HEIGHT, WIDTH, K, camera_at, random_cloud, rotation_matrix

REFERENCE = Path(__file__).resolve().parents[1] / "reference"


def test_cpu_backend_passes_its_own_probe() -> None:
    assert select_backend("cpu").name == "cpu"
    assert compare_with_cpu(CpuBackend()) == ""


def test_cpu_draws_the_probe_as_gsplats_own_torch_code_does() -> None:
    """Pinned pixels; how they were made stands in the file."""
    pixels = json.loads((REFERENCE / "gsplat_probe.json").read_text())["pixels"]
    x, y, *_ = np.array(pixels, dtype=object).T
    wanted = np.array([pixel[2:] for pixel in pixels], dtype=np.float64)
    gaussians, viewmat, K = probe_scene()
    got = rasterise_view(prepare_gaussians(gaussians), viewmat, K, 64, 48)
    at = y.astype(int), x.astype(int)
    assert np.abs(got.rgb[at] - wanted[:, :3]).max() < 5e-6
    assert np.abs(got.alpha[at] - wanted[:, 3]).max() < 5e-6
    # gsplat's depth is that of the centres, ours that of the surface: here only what is covered must agree
    assert (np.isnan(got.depth[at]) == np.isnan(wanted[:, 4])).all()
    assert np.abs(got.normal[at] - wanted[:, 5:8]).max() < 2e-5
    assert got.class_id[at].tolist() == wanted[:, 8].tolist()


def test_probe_names_what_a_wrong_backend_draws_wrong() -> None:
    class Mirrored(CpuBackend):
        @staticmethod
        def rasterise_view(
            prepared: Any, viewmat: NDArray, K: NDArray, width: int, height: int, normals: bool = True
        ) -> GBuffer:
            drawn = CpuBackend.rasterise_view(prepared, viewmat, K, width, height)
            return replace(drawn, rgb=drawn.rgb[:, ::-1], class_id=np.roll(drawn.class_id, 5))

    problem = compare_with_cpu(Mirrored())
    assert "rgb differs" in problem and "class differs" in problem and "depth" not in problem


def test_auto_without_a_gpu_is_the_cpu_and_does_not_import_torch() -> None:
    code = (
        "import sys; from pathlib import Path; from tasks.render.rasterise import backend;"
        "backend._GPU_DEVICES = (Path('/nowhere/gpu'),);"
        "print(backend.select_backend('auto').name, 'torch' in sys.modules)"
    )
    done = subprocess.run((sys.executable, "-c", code), capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["cpu", "False"]


def test_auto_falls_back_to_the_cpu_where_gsplat_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(backend, "_GPU_DEVICES", (Path(__file__),))
    monkeypatch.setattr(backend, "compare_with_cpu", lambda _: "rgb differs by up to 1 from the CPU's")
    assert select_backend("auto").name == "cpu"
    with pytest.raises(InputError, match="gsplat cannot be used here"):
        select_backend("gsplat")


def test_an_unknown_backend_lists_those_that_exist() -> None:
    with pytest.raises(InputError, match="must be one of auto, cpu, gsplat; it is 'cuda'"):
        select_backend("cuda")


def test_gsplats_class_is_found_where_light_falls_below_one_half() -> None:
    """Two tiles of 4 x 4: in the first a faint splat before a solid one, in the second none that halves the light."""
    front = np.full((4, 8), -1)
    means, conics = np.float32([[1.5, 1.5], [1.5, 1.5], [6.5, 1.5]]), np.float32([[1, 0, 1]] * 3)
    opacities, starts = np.float32([0.3, 0.75, 0.45]), np.int32([[0, 2]])
    for row in range(4):
        for column in range(8):
            find_front(row, column, front, means, conics, opacities, starts, np.int32([0, 1, 2]), 4)
    # half of the light is left where .3 and .75 of a normal law's height at the distance d leave half of it
    dx, dy = np.meshgrid(np.arange(4) - 1.0, np.arange(4) - 1.0)
    falloff = np.exp(-(dx**2 + dy**2) / 2)
    assert (front[:, :4] == np.where((1 - 0.3 * falloff) * (1 - 0.75 * falloff) < 0.5, 1, -1)).all()
    assert (front[:, 4:] == -1).all() and (front[:, :4] == 1).any()


@pytest.mark.gpu
def test_gsplat_draws_the_cpus_picture() -> None:
    if not any(device.exists() for device in backend._GPU_DEVICES):
        pytest.skip("no CUDA device here")
    pytest.importorskip("gsplat", reason="gsplat is not installed; it comes with the gpu extra")
    gpu, cpu = select_backend("gsplat"), CpuBackend()
    for seed, sh_count in ((0, 16), (1, 4), (2, 1)):
        gaussians, viewmat = (
            random_cloud(1500, sh_count, seed),
            camera_at((0.1, 0.2, 0), rotation_matrix(seed)),
        )
        got = gpu.rasterise_view(gpu.prepare_gaussians(gaussians), viewmat, K, WIDTH, HEIGHT).on_host()
        wanted = cpu.rasterise_view(cpu.prepare_gaussians(gaussians), viewmat, K, WIDTH, HEIGHT)
        assert np.mean((got.rgb - wanted.rgb) ** 2) < 1e-6
        assert np.mean((got.alpha - wanted.alpha) ** 2) < 1e-6
        assert np.nanmean(np.abs(got.depth / wanted.depth - 1)) < 1e-3
        assert np.mean(got.class_id != wanted.class_id) < 0.01
