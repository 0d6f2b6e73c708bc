"""Pixels whose image does not move as their depth says."""

import numpy as np
from numpy.typing import NDArray

from tasks.conventions import ROAD_CLASSES, SemanticClass


def unusable_pixels(class_id: NDArray[np.uint8], film_depth_mm: float) -> NDArray[np.bool_]:
    """Return the pixels that no check may read.

    They are the sky, which has no depth; crowns of trees, which are partly transparent and have no single depth; and a
    wet road, which mirrors the street, so that its image moves as the mirrored object does.

    Parameters
    ----------
    class_id : uint8 [F, H, W] semantic classes [1]
    film_depth_mm : water on the road [mm]

    Returns
    -------
    bool [F, H, W]
    """
    hidden = np.zeros(256, dtype=np.bool_)  # a table of all bytes: a tenth of the time of `np.isin`
    hidden[[SemanticClass.SKY, SemanticClass.VEGETATION]] = True
    if film_depth_mm > 0:
        hidden[list(ROAD_CLASSES)] = True
    return hidden[class_id]


def glossy_pixels(class_id: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return the pixels of vehicles, whose paint and panes mirror the street in soft gradients, and which may move.

    A check by every grey level takes such gradients for motion. Sharp corners belong to the body itself.

    Parameters
    ----------
    class_id : uint8 [F, H, W] semantic classes [1]

    Returns
    -------
    bool [F, H, W]
    """
    return class_id == SemanticClass.VEHICLE


def hide_moving(depth: NDArray[np.floating], instances: NDArray[np.uint16]) -> NDArray[np.floating]:
    """Return the depth without that of road users, which move as no camera does; no check reads a pixel without depth.

    Parameters
    ----------
    depth : [F, H, W] camera z [m]
    instances : uint16 [F, H, W] number of the road user that a pixel shows, as a dataset has it; 0 for none
    """
    return np.where(instances > 0, np.nan, depth).astype(depth.dtype)
