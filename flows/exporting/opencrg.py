"""OpenCRG: the road under each clip, as curved regular grid with one profile, for vehicle simulation tools.

One ``NAME.crg`` a clip, in the text form ``LRFI``: a straight reference line along the route's station u [m] and, at
each step, heights from v = -2.1 m to +2.1 m (v to the left, as ISO 8855), z up [m], positive for a hump. The feature is
the same across the road. The scene's own bends and slopes are not in it: the vehicle drives along the station.

There is no official reader in Python; the test reads the file by the same specification.

Format: ASAM OpenCRG 1.1.2, https://www.asam.net/standards/detail/opencrg
"""

from pathlib import Path

import numpy as np

from flows.exporting.dataset import ExportedDataset
from flows.making.driving import hazard_of
from tasks.surface.road_profile import RoadHazard, road_elevation

STEP = 0.02
"""From one cross section to the next [m]: a hump of 2 m has a hundred."""
SIDES = tuple(round(-2.1 + 0.6 * k, 1) for k in range(8))
"""Sections along the road, right to left [m]: eight numbers of ten characters fill the form's record of 80."""
MARGIN = 5.0
"""Road before the first wheel and beyond the last station [m]."""


def write_opencrg(dataset: ExportedDataset, folder: Path) -> None:
    """Write ``NAME.crg`` for each clip.

    Parameters
    ----------
    dataset : with frames or without
    folder : empty
    """
    wheelbase = dataset.vehicle.cg_to_front_axle + dataset.vehicle.cg_to_rear_axle
    for clip in dataset:
        station = clip.ticks["station"]
        begin = np.floor(float(station.min()) - wheelbase - MARGIN)
        end = np.ceil(float(station.max()) + MARGIN)
        text = format_crg(hazard_of(clip.scenario), float(begin), float(end), clip.label)
        (folder / f"{clip.name}.crg").write_text(text)


def format_crg(hazard: RoadHazard, begin: float, end: float, title: str) -> str:
    """Return the road from one station to another as the text of a CRG file.

    Parameters
    ----------
    hazard : the road feature
    begin, end : stations [m]
    title : comment
    """
    sections = round((end - begin) / STEP) + 1
    heights = road_elevation(begin + STEP * np.arange(sections), hazard)
    head = [
        "$CT", title.encode("ascii", "replace").decode()[:70], "$",
        "$ROAD_CRG",
        f"REFERENCE_LINE_START_U   = {begin:.6f}",
        f"REFERENCE_LINE_END_U     = {begin + STEP * (sections - 1):.6f}",
        f"REFERENCE_LINE_INCREMENT = {STEP:.6f}",
        "REFERENCE_LINE_START_PHI = 0.000000",
        f"LONG_SECTION_V_RIGHT     = {SIDES[0]:.6f}",
        f"LONG_SECTION_V_LEFT      = {SIDES[-1]:.6f}",
        f"LONG_SECTION_V_INCREMENT = {SIDES[1] - SIDES[0]:.6f}",
        "$",
        "$KD_Definition",
        "#:LRFI",
        f"U:reference line u,m,{begin:.3f},{STEP:.3f}",
        *(f"D:long section {k + 1},m" for k in range(len(SIDES))),
        "$",
        "$" * 80,
    ]  # fmt: skip
    return "\n".join([*head, *(f"{height:10.7f}" * len(SIDES) for height in heights)]) + "\n"
