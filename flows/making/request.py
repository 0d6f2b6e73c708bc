"""A request for a dataset: of a grid, or of a frozen run that is made again."""

from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from catalogs.entries import load
from flows.making.freezing import reproduce_run
from flows.making.generate import generate_dataset
from flows.making.run_report import RunReport
from tasks.errors import InputError


def make_dataset(
    grid: str | None,
    out: str,
    *,
    manifest: str | None = None,
    vehicle: str | None = None,
    poses: str | None = None,
    pictures: bool | Literal["later"] = True,
    **execution: Any,
) -> dict[str, Any]:
    """Make the dataset of a grid, or that of a frozen run again.

    Parameters
    ----------
    grid : grid file or name; None with a ``manifest``
    out : dataset folder, or its address in an object store
    manifest : name or file of a frozen run, in place of a grid
    vehicle, pictures : as of `flows.making.generate.generate_dataset`; a frozen run has its own
    poses : folder of reference traces whose motion the clips show in place of the vehicle's
    execution : ``runner``, ``workers``, ``scheduler`` and ``backend`` of `flows.making.generate.generate_dataset`

    Returns
    -------
    ``run_id``, ``clips``, ``made``, ``quarantined`` (reasons by label), ``dataset``, ``manifest`` and
    ``contact_sheet``; of a frozen run also ``reproduced`` and ``telemetry_differs`` (labels)

    Raises
    ------
    InputError
        For neither or both of grid and manifest, and as `generate_dataset` and `reproduce_run` raise it.
    """
    if grid is not None and manifest is None:
        asked = grid if poses is None else replace(load("grid", grid), poses=Path(poses))
        return list_facts(generate_dataset(asked, out, vehicle=vehicle, pictures=pictures, **execution))
    if manifest is None or grid is not None:
        raise InputError("generate needs either a GRID or --manifest NAME, and not both")
    if vehicle is not None or poses is not None or pictures is not True:
        raise InputError(
            "--manifest sets the vehicle, its motion and whether frames are rendered: leave out --vehicle, --poses and"
            " --frames"
        )
    report, differing = reproduce_run(manifest, out, **execution)
    return list_facts(report) | {
        "reproduced": report.clips - len(differing),
        "telemetry_differs": differing,
    }


def list_facts(report: RunReport) -> dict[str, Any]:
    layout = report.layout
    sheet = layout.previews / "contact_sheet.png"
    return {
        "run_id": report.run_id,
        "clips": report.clips,
        "made": report.made,
        "quarantined": report.quarantined,
        "dataset": str(layout),
        "manifest": str(layout.manifest),
        "contact_sheet": str(sheet) if sheet.is_file() else None,
    }
