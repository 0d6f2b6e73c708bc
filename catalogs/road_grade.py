"""The grade of a scene's road as a dataset keeps it, so that its motion follows from its inputs without the scene."""

import re
from typing import Annotated

from catalogs.quantities import CatalogueEntry, Scalar, Table, require_quantity
from tasks.surface.road_profile import RoadGrade

ROAD_GRADE = "road_grade.yaml"
"""Name among the kept inputs; a dataset of a level road keeps none."""
SCENE_GRADES = "road_grade/"
"""Folder of the grades in a dataset of several scenes: one file for each scene that is not level."""


def name_grade_file(scene: str | None) -> str:
    """Return the name among the kept inputs of a scene's grade.

    Parameters
    ----------
    scene : that a clip names; None where the dataset has one
    """
    return ROAD_GRADE if scene is None else f"{SCENE_GRADES}{re.sub(r'[^A-Za-z0-9_.=-]', '_', scene)}.yaml"


class RoadGradeEntry(CatalogueEntry):
    """Content of the file; `RoadGrade` gives the meanings."""

    spacing: Annotated[Scalar, require_quantity("m", above=0)]
    rise: Annotated[Table, require_quantity("1", above=-1, below=1)]

    def build(self) -> RoadGrade:
        """The grade itself."""
        return RoadGrade(rise=self.rise.value, spacing_m=self.spacing.value)


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
