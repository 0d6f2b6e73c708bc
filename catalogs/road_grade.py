"""The grade of a scene's road as a dataset keeps it, so that its motion follows from its inputs without the scene."""

from pathlib import Path
from typing import Annotated

from catalogs.quantities import CatalogueEntry, Scalar, Table, read_entry, require_quantity
from tasks.surface.road_profile import LEVEL_ROAD, RoadGrade

ROAD_GRADE = "road_grade.yaml"
"""Name among the kept inputs; a dataset of a level road keeps none."""


class RoadGradeEntry(CatalogueEntry):
    """Content of the file; `RoadGrade` gives the meanings."""

    spacing: Annotated[Scalar, require_quantity("m", above=0)]
    rise: Annotated[Table, require_quantity("1", above=-1, below=1)]


def write_road_grade(grade: RoadGrade, scene: str) -> bytes:
    """Return the file's content.

    Parameters
    ----------
    grade : of the road
    scene : whose route it is of, by the name that is recorded
    """
    source = f"route of scene {scene}: rise of P_0 per metre of way, over 10 m"
    values = ", ".join(f"{one:.9f}" for one in grade.rise)
    return (
        "# Grade of the road along the route: linear between the stations, constant beyond the last.\n"
        f'spacing: {{value: {grade.spacing_m:.9f}, unit: m, source: "{source}"}}\n'
        f'rise: {{value: [{values}], unit: "1", source: "{source}"}}\n'
    ).encode()


def load_kept_grade(inputs: Path) -> RoadGrade:
    """Read the grade among a dataset's kept inputs; level where it keeps none.

    Parameters
    ----------
    inputs : folder of the kept catalogue files

    Raises
    ------
    InputError
        Listing every problem of the file.
    """
    kept = inputs / ROAD_GRADE
    if not kept.is_file():
        return LEVEL_ROAD
    entry = read_entry(RoadGradeEntry, kept, "grade of the road")
    return RoadGrade(rise=entry.rise.value, spacing_m=entry.spacing.value)
