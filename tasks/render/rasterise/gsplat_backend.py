"""The same views drawn by gsplat 1.5 (Apache-2.0) on a CUDA device.

gsplat compiles its kernels with nvcc at first use. It blends colours that are evaluated before, here
three of light and three of the normal, and expected depth. Class and surface depth follow from the disc at which a
pixel's transmittance falls below one half: it is sought in the tile's list that gsplat returns.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import gsplat
import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tasks.render.pixels import run_on_device
from tasks.render.rasterise.blending import SURFACE_RATIO
from tasks.render.rasterise.front import find_front
from tasks.render.rasterise.gbuffer import GBuffer
from tasks.render.rasterise.painters_bias_torch import move_nearer
from tasks.render.rasterise.placed_body import PlacedBody, Shade
from tasks.render.rasterise.preparation import morton_order
from tasks.render.rasterise.projection import NEAR, low_pass
from tasks.render.rasterise.view import view_of
from tasks.scene.gaussians import Gaussians, check_gaussians


@dataclass(frozen=True, kw_only=True)
class DeviceGaussians:
    """A cloud on the device: the arrays of `Gaussians` as tensors."""

    means: torch.Tensor
    quats: torch.Tensor
    scales: torch.Tensor
    opacities: torch.Tensor
    sh: torch.Tensor
    normals: torch.Tensor
    class_id: torch.Tensor
    object_id: torch.Tensor
    places: torch.Tensor
    surroundings: torch.Tensor | None
    antialiased: bool


class GsplatBackend:
    """gsplat as a `tasks.render.rasterise.backend.Backend`.

    Parameters
    ----------
    device : torch device with gsplat's kernels
    """

    name = "gsplat"

    def __init__(self, device: str = "cuda"):
        self.device = torch.device(device)
        if self.device.type == "cuda" and not torch.cuda.is_available():
            raise RuntimeError("torch finds no CUDA device")

    def prepare_gaussians(self, gaussians: Gaussians) -> DeviceGaussians:
        """Check a cloud and copy it to the device, along the curve of `tasks.render.rasterise.preparation`.

        Raises
        ------
        InputError
            An array has a wrong shape, a NaN or a value out of range.
        """
        check_gaussians(gaussians)
        # centres of one depth are drawn in the order of the cloud: here as on the CPU
        order = morton_order(gaussians.means)
        return DeviceGaussians(
            means=self._to_tensor(gaussians.means[order]),
            quats=self._to_tensor(gaussians.quats_wxyz[order]),
            scales=self._to_tensor(gaussians.scales[order]),
            opacities=self._to_tensor(gaussians.opacities[order]),
            sh=self._to_tensor(gaussians.sh[order]),
            normals=self._to_tensor(gaussians.normals[order]),
            class_id=self._to_tensor(gaussians.class_id[order]),
            places=self._to_tensor(np.argsort(order)),
            object_id=torch.zeros(len(order), dtype=torch.int32, device=self.device),
            surroundings=None
            if gaussians.surroundings is None
            else self._to_tensor(gaussians.surroundings[order]),
            antialiased=gaussians.antialiased,
        )

    def recolour(self, prepared: DeviceGaussians, sh: NDArray[np.float32]) -> DeviceGaussians:
        """Return a prepared cloud with other colours; see `Backend.recolour`."""
        return replace(prepared, sh=self._to_tensor(sh[np.argsort(prepared.places.cpu().numpy())]))

    @torch.no_grad()
    def rasterise_view(
        self,
        prepared: DeviceGaussians,
        viewmat: NDArray[np.floating],
        K: NDArray[np.floating],
        width: int,
        height: int,
        normals: bool = True,
        bodies: Sequence[PlacedBody] = (),
        shade: Shade | None = None,
    ) -> GBuffer:
        """Draw one view, always with its normals, into tensors; see `Backend.rasterise_view`."""
        light = torch.ones(len(prepared.means), device=self.device)
        if shade is not None:
            light[prepared.places[self._to_tensor(shade.index)]] = self._to_tensor(shade.share)
        scene, prepared = len(prepared.means), self._add_bodies(prepared, bodies)
        view = view_of(viewmat, K, width, height)
        direction = prepared.means - self._to_tensor(view.eye.astype(np.float32))
        degree = int(prepared.sh.shape[1] ** 0.5) - 1
        colours = (gsplat.spherical_harmonics(degree, direction, prepared.sh) + 0.5).clamp_min(0)
        colours[len(colours) - scene :] *= light[:, None]
        away = (prepared.normals * direction).sum(dim=1, keepdim=True) > 0
        facing = torch.where(away, -prepared.normals, prepared.normals)
        means, covariances = prepared.means, None
        if prepared.surroundings is not None:
            means, covariances = move_nearer(
                means,
                prepared.quats,
                prepared.scales,
                prepared.normals,
                prepared.surroundings,
                view,
                low_pass(prepared.antialiased),
            )
        blended, alpha, splats = gsplat.rasterization(
            means=means,
            quats=prepared.quats,
            scales=prepared.scales,
            covars=covariances,
            opacities=prepared.opacities,
            colors=torch.cat((colours, facing), dim=1),
            viewmats=self._to_tensor(view.viewmat.astype(np.float32))[None],
            Ks=self._to_tensor(view.K.astype(np.float32))[None],
            width=width,
            height=height,
            near_plane=NEAR,
            eps2d=low_pass(prepared.antialiased),
            rasterize_mode="antialiased" if prepared.antialiased else "classic",
            render_mode="RGB+ED",
            packed=False,
        )
        alpha = alpha[0, ..., 0]
        normal = torch.nn.functional.normalize(blended[0, ..., 3:6], dim=-1)
        expected = torch.where(alpha > 0, blended[0, ..., 6], torch.nan)
        front = torch.full((height, width), -1, dtype=torch.int64, device=self.device)
        run_on_device(
            find_front, front, splats["means2d"][0], splats["conics"][0], splats["opacities"][0],
            splats["isect_offsets"][0], splats["flatten_ids"], splats["tile_size"],
        )  # fmt: skip
        seen, splat = front >= 0, front.clamp_min(0)
        pixels = np.dstack(np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5, 1.0))
        rays = self._to_tensor((pixels @ view.rays).astype(np.float32))
        plane = (facing * direction).sum(dim=1)[splat] / (facing[splat] * rays).sum(dim=-1)
        centre = splats["depths"][0, splat]
        tilted = (plane < centre * SURFACE_RATIO) & (centre < plane * SURFACE_RATIO)
        depth = torch.where(seen, torch.where(tilted, plane, centre), expected)
        class_id = torch.where(seen, prepared.class_id[splat], 0)
        object_id = torch.where(seen, prepared.object_id[splat], 0)
        return GBuffer(
            rgb=blended[0, ..., :3],
            depth=depth,  # type: ignore[arg-type]
            expected_depth=expected,  # type: ignore[arg-type]
            alpha=alpha,
            normal=normal,  # type: ignore[arg-type]
            class_id=class_id.to(torch.uint8),  # type: ignore[arg-type]
            object_id=object_id.to(torch.uint16),  # type: ignore[arg-type]
        )

    def _add_bodies(self, prepared: DeviceGaussians, bodies: Sequence[PlacedBody]) -> DeviceGaussians:
        """Return the cloud with the bodies where they stand; their colour must not depend on the direction."""
        if not bodies:
            return prepared
        clouds = [*(self._stand(body, prepared.sh.shape[1]) for body in bodies), prepared]
        tensors: dict[str, Any] = {
            field.name: torch.cat([getattr(cloud, field.name) for cloud in clouds])
            for field in fields(DeviceGaussians)
            if isinstance(getattr(prepared, field.name), torch.Tensor)
        }
        return replace(prepared, **tensors)

    def _stand(self, body: PlacedBody, harmonics: int) -> DeviceGaussians:
        own: DeviceGaussians = body.prepared
        R = self._to_tensor(body.T_world_body[:3, :3].astype(np.float32))
        turn = Rotation.from_matrix(body.T_world_body[:3, :3])
        quats = turn * Rotation.from_quat(own.quats.cpu().numpy(), scalar_first=True)
        sh = torch.zeros((len(own.means), harmonics, 3), device=self.device)
        sh[:, :1] = own.sh[:, :1]
        return replace(
            own,
            means=own.means @ R.T + self._to_tensor(body.T_world_body[:3, 3].astype(np.float32)),
            quats=self._to_tensor(quats.as_quat(scalar_first=True).astype(np.float32)),
            normals=own.normals @ R.T,
            sh=sh,
            object_id=own.object_id + body.number,
        )

    def keep(self, array: NDArray[Any]) -> torch.Tensor:
        """Return a picture on the device, for all frames of a clip; see `Backend.keep`."""
        return self._to_tensor(array)

    def _to_tensor(self, array: NDArray[Any]) -> torch.Tensor:
        return torch.from_numpy(np.ascontiguousarray(array)).to(self.device)
