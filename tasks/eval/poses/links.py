"""Longer steps beside a chain of short ones: what every short step gets wrong alike, a long one gets wrong once."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tasks.eval.poses.motion import FrameStep, Placement
from tasks.eval.poses.rigid import Floats, adjoint, invert_pose, pose_from_twist

LEAST_STD = 1e-7
"""Error below which no step is believed [m, rad]: a step that states none would leave nothing to share out."""
PASSES = 2
"""Linear solutions in a row; the corrections are milliradians, so that the second already is rounding."""


@dataclass(frozen=True, kw_only=True)
class Link:
    """A step between two frames beside those of the chain.

    Parameters
    ----------
    earlier, later : the frames
    step : between them, in camera frames
    """

    earlier: int
    later: int
    step: FrameStep


def chained_poses(placements: Sequence[Placement]) -> list[Floats]:
    """Camera poses [4, 4] in the camera of frame 0 [m]; NaN where a frame has none."""
    poses = [np.eye(4)]
    for placed in placements:
        poses.append(poses[placed.anchor] @ placed.step.T_earlier_later)
    return poses


def link_placements(placements: Sequence[Placement], links: Sequence[Link]) -> list[Placement]:
    """Share out between chain and links what they disagree on, by least squares over all poses.

    The covariances stay those of the chain, an upper bound: the errors of links are no more independent of
    each other than those of the short steps are.

    Parameters
    ----------
    placements : one for each frame after the first
    links : further steps; failed ones are passed over

    Returns
    -------
    the placements with the steps of the adjusted poses; failed ones as they were

    Source: Lu and Milios 1997, DOI 10.1023/A:1008854305733.
    """
    useful = [link for link in links if not link.step.failure]
    if not useful:
        return list(placements)
    poses = np.stack(chained_poses(placements))
    chain = [
        Link(earlier=p.anchor, later=k, step=p.step)
        for k, p in enumerate(placements, 1)
        if not p.step.failure
    ]
    edges = chain + useful
    for _ in range(PASSES):
        poses = poses @ np.stack([pose_from_twist(twist) for twist in _corrections(poses, edges)])
    return [
        placed
        if placed.step.failure
        else replace(
            placed, step=replace(placed.step, T_earlier_later=invert_pose(poses[placed.anchor]) @ poses[k])
        )
        for k, placed in enumerate(placements, 1)
    ]


def _corrections(poses: Floats, edges: Sequence[Link]) -> Floats:
    """Right twists [F, 6] that bring the poses nearest to all edges, to first order; 0 in frame 0."""
    count = len(poses)
    H, gradient = np.zeros((count, 6, count, 6)), np.zeros((count, 6))
    for edge in edges:
        a, b = edge.earlier, edge.later
        between = invert_pose(poses[a]) @ poses[b]
        missed = edge.step.T_earlier_later @ invert_pose(between)
        error = np.array(
            [
                *missed[:3, 3],
                missed[2, 1] - missed[1, 2],
                missed[0, 2] - missed[2, 0],
                missed[1, 0] - missed[0, 1],
            ]
        )
        error[3:] /= 2
        weight = np.linalg.inv(edge.step.covariance + np.eye(6) * LEAST_STD**2)
        by_later = -adjoint(between)
        H[a, :, a] += weight
        H[b, :, b] += by_later.T @ weight @ by_later
        H[a, :, b] += weight @ by_later
        H[b, :, a] += by_later.T @ weight
        gradient[a] += weight @ error
        gradient[b] += by_later.T @ weight @ error
    free = np.unique([edge.later for edge in edges])
    twists = np.zeros((count, 6))
    system = H[free][:, :, free].reshape(6 * len(free), 6 * len(free))
    twists[free] = -np.linalg.solve(system, gradient[free].ravel()).reshape(-1, 6)
    return twists
