"""The paper's printed agreement of its vehicle model with CarSim, by split and group of cases."""

from dataclasses import replace
from typing import Annotated, Any

from pydantic import Field

from catalogs.entries import load
from catalogs.names import Name
from catalogs.quantities import CatalogueEntry, CatalogueList, Number, Text
from catalogs.reference_match import list_differences
from catalogs.references import ReferenceCase

SPLITS = {
    "development": "development",
    "held-out": "held-out", "held_out": "held-out", "holdout": "held-out",
    "speed_check": "initial-speed", "speed-check": "initial-speed", "initial-speed": "initial-speed",
}  # fmt: skip
"""The paper's split behind the name of one in a folder of traces."""

COASTING = "the cases here brake, the paper's coast by their slip"


class PrintedGroup(CatalogueEntry):
    """Figures of a group: means and, where they are printed, largest values."""

    count: Annotated[int, Field(gt=0)]
    mean: dict[Name, Number]
    maximum: dict[Name, Number] = Field(default_factory=dict)


class AgreementFile(CatalogueList[dict[Name, dict[Name, PrintedGroup | Text]]]):
    """Content of the file: the printed figures by split and group, and notes on a split."""

    def build(self) -> dict[str, dict[str, PrintedGroup]]:
        """Return the printed figures by split and group."""
        return {
            split: {name: group for name, group in groups.items() if isinstance(group, PrintedGroup)}
            for split, groups in self.root.items()
        }


def find_printed_name(case: ReferenceCase) -> str:
    """Return the name under which the paper prints a case: that of its conditions, whatever the folder calls it.

    Parameters
    ----------
    case : of a folder of traces; one with other conditions than the paper's keeps its name
    """
    same = [
        condition.name
        for condition in load("list of conditions")
        if condition.scenario.precipitation_mm_h == (case.precipitation_mm_h or 0.0)
        and not list_differences(
            case, replace(condition.scenario, hold_speed=case.braked), case.surface_coefficient
        )
    ]
    return same[0] if same else case.case


def put_beside_print(groups: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return a row for each printed figure of the groups that an agreement has.

    Parameters
    ----------
    groups : rows with split, group, count, mean and maximum of every figure, and whether the split's road cases brake;
        ``paper_group`` is the paper's name of a group where that is another
    """
    rows: list[dict[str, Any]] = []
    for group in groups:
        name = group.get("paper_group", group["group"])
        printed = load("table of printed agreement").get(SPLITS.get(group["split"], ""), {}).get(name)
        if printed is None:
            continue
        rows += [
            {
                "split": group["split"], "group": group["group"], "paper_group": name, "figure": figure,
                "cases": group["count"], "mean": group.get(figure),
                "maximum": group["maximum"].get(figure), "paper_cases": printed.count,
                "paper_mean": printed.mean[figure], "paper_maximum": printed.maximum.get(figure),
                "note": COASTING if group["road_cases_brake"] and SPLITS[group["split"]] == "initial-speed" else "",
            }
            for figure in printed.mean
        ]  # fmt: skip
    return rows
