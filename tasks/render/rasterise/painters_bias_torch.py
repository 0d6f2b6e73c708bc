"""Correction of the painter's bias by moved Gaussians, for a rasteriser that takes these instead of splats.

The rules of `tasks.render.rasterise.projection`, on tensors.
"""

import torch

from tasks.render.rasterise.painters_bias import INTERVALS, LARGEST_SHIFT, OVERLAP_SCALE, SHIFTS, STEEPEST
from tasks.render.rasterise.projection import NEAR
from tasks.render.rasterise.view import View

_FACING = 1e-20


def move_nearer(
    means: torch.Tensor,
    quats_wxyz: torch.Tensor,
    scales: torch.Tensor,
    normals: torch.Tensor,
    surroundings: torch.Tensor,
    view: View,
    low_pass: float,
) -> tuple[torch.Tensor, torch.Tensor]:
    """Return centres and covariances, in the world, of Gaussians that project to the corrected splats.

    Camera z, and so the order, stays but for rounding. A Gaussian in another place is seen along another ray, which
    would change its splat: each is sheared across the camera's axis by as much as its ray turns.

    Parameters
    ----------
    means, quats_wxyz, scales, normals, surroundings : as in `Gaussians`, on one device
    view : the camera
    low_pass : variance added to both picture axes [px^2]

    Returns
    -------
    float32 [N, 3] centres; those nearer than the near plane or behind it are not moved [m]
    float32 [N, 3, 3] covariances [m^2]
    """
    R, t = means.new_tensor(view.viewmat[:3, :3]), means.new_tensor(view.viewmat[:3, 3])
    focal = means.new_tensor((view.K[0, 0], view.K[1, 1]))
    limits = means.new_tensor(view.ray_limits.reshape(2, 2))
    in_camera = means @ R.T + t
    drawn = in_camera[:, 2:] >= NEAR
    z = torch.where(drawn, in_camera[:, 2:], 1.0)
    ray = in_camera[:, :2] / z
    bounded = ray.clamp(limits[:, 0], limits[:, 1])
    axes = (_rotation_matrices(quats_wxyz) * scales[:, None, :]).transpose(1, 2) @ R.T
    rows = focal / z[:, None] * (axes[..., :2] - bounded[:, None] * axes[..., 2:])
    covariance = rows.transpose(1, 2) @ rows + low_pass * torch.eye(2, device=means.device)

    normal = normals @ R.T
    gradient = normal[:, :2] / focal
    slant = (normal[:, :2] * ray).sum(dim=1) + normal[:, 2]
    along = (covariance @ gradient[..., None])[..., 0]
    own = (gradient * along).sum(dim=1).clamp_min(_FACING)
    pixel = low_pass * (gradient**2).sum(dim=1)
    overlap, size = surroundings.T
    neighbours = (size**2 * (own - pixel) + pixel).clamp_min(_FACING)
    closeness = own.sqrt() / slant.abs().clamp_min(_FACING) * (1 - pixel / own)
    way = (
        _interpolate_shift(overlap, (own / neighbours).sqrt(), closeness)
        / own.sqrt()
        * torch.where(slant > 0, 1.0, -1.0)
    )
    turn = torch.where(drawn, way[:, None] * along / focal, 0.0)
    moved = means + torch.cat((turn * z, torch.zeros_like(z)), dim=1) @ R
    shear = (ray + turn).clamp(limits[:, 0], limits[:, 1]) - bounded
    sheared = torch.cat((axes[..., :2] + shear[:, None] * axes[..., 2:], axes[..., 2:]), dim=2) @ R
    return moved, sheared.transpose(1, 2) @ sheared


def _interpolate_shift(overlap: torch.Tensor, ratio: torch.Tensor, closeness: torch.Tensor) -> torch.Tensor:
    """`tasks.render.rasterise.painters_bias.interpolate_shift`."""
    i, j = overlap / (overlap + OVERLAP_SCALE) * INTERVALS, ratio / (ratio + 1) * INTERVALS
    row, column = (place.long().clamp_max(INTERVALS - 1) for place in (i, j))
    terms = overlap.new_tensor(SHIFTS)
    down, across = i - row, j - column
    total = torch.zeros_like(overlap)
    for di, weight in ((0, 1 - down), (1, down)):
        for dj, share in ((0, 1 - across), (1, across)):
            corner = terms[row + di, column + dj]
            total += weight * share * (corner[:, 0] + closeness.clamp_max(STEEPEST) * corner[:, 1])
    return total.clamp_max(LARGEST_SHIFT)


def _rotation_matrices(quats_wxyz: torch.Tensor) -> torch.Tensor:
    """Return the rotation matrices of unit quaternions, [N, 3, 3]."""
    w, x, y, z = quats_wxyz.T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return torch.stack([torch.stack(row, dim=1) for row in rows], dim=1)
