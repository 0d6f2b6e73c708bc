"""OpenDRIVE: one ``SCENE.xodr`` for the road of each street of a dataset."""

from pathlib import Path

from catalogs.scenes.opendrive import find_street, format_opendrive
from flows.exporting.dataset import ExportedDataset


def write_opendrive(dataset: ExportedDataset, folder: Path) -> None:
    """Write ``SCENE.xodr`` for each street.

    Parameters
    ----------
    dataset : with frames or without
    folder : empty

    Raises
    ------
    InputError
        If a scene is no street that muSync makes.
    """
    streets = {scene["name"]: find_street(scene["name"]) for scene in dataset.plan.every_scene}
    for name, layout in streets.items():
        (folder / f"{name}.xodr").write_text(format_opendrive(layout, name))
    for _ in dataset:
        pass
