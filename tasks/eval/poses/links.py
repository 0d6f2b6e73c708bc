"""Longer steps beside a chain of short ones: an error common to all short steps enters a long step only once."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tasks.eval.poses.motion import FrameStep, Placement
from tasks.eval.poses.rigid import Floats, adjoint_matrix, invert_pose
from tasks.eval.poses.twists import pose_from_twist

LEAST_STD = 1e-7
"""Least standard error of a step [m, rad]: with an error of 0 a step could not be adjusted at all."""
PASSES = 2
"""Linear solutions one after the other; corrections are milliradians, so that the second one is at rounding level."""


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
    """Return camera poses [4, 4] in the camera of frame 0 [m]; NaN where a frame has none."""
    poses = [np.eye(4)]
    for placed in placements:
        poses.append(poses[placed.anchor] @ placed.step.T_earlier_later)
    return poses


def link_placements(placements: Sequence[Placement], links: Sequence[Link]) -> list[Placement]:
    """Adjust the chain to the links by least squares over all poses.

    The covariances stay those of the chain, an upper bound: the errors of the links are as dependent on each other
    as those of the short steps.

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
        poses = poses @ np.stack([pose_from_twist(twist) for twist in _solve_corrections(poses, edges)])
    return [
        placed
        if placed.step.failure
        else replace(
            placed, step=replace(placed.step, T_earlier_later=invert_pose(poses[placed.anchor]) @ poses[k])
        )
        for k, placed in enumerate(placements, 1)
    ]


def _solve_corrections(poses: Floats, edges: Sequence[Link]) -> Floats:
    """Return right twists [F, 6] that bring the poses nearest to all edges, to first order; 0 in frame 0."""
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
        by_later = -adjoint_matrix(between)
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
