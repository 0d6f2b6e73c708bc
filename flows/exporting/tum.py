"""TUM trajectories: one text file a clip with the camera's pose at every frame.

A row is ``timestamp tx ty tz qx qy qz qw``: time since the start of the clip [s], position [m] and rotation of the
camera (x right, y down, z forward, as ours) in our world (ISO 8855, z up). Numbers read back to the same double.

Format: https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats
"""

from pathlib import Path

import numpy as np

from flows.exporting.dataset import ExportedDataset
from flows.exporting.poses import compute_quaternions


def write_tum(dataset: ExportedDataset, folder: Path) -> None:
    """Write ``NAME.txt`` for each clip.

    Parameters
    ----------
    dataset : with frames or without
    folder : empty
    """
    for clip in dataset:
        poses = clip.T_world_camera
        rows = np.column_stack(
            (clip.frames["t_ns"] / 1e9, poses[:, :3, 3], compute_quaternions(poses, scalar_first=False))
        )
        text = "".join(" ".join(map(repr, row)) + "\n" for row in rows.tolist())
        (folder / f"{clip.name}.txt").write_text(f"# timestamp tx ty tz qx qy qz qw\n{text}")
