"""The card that lies in every export: the dataset that it was made from, its run, seal, units and camera."""

from typing import Any

from catalogs.variants import warn_of_variant
from flows.exporting.camera import describe_camera
from flows.exporting.dataset import TICK_COLUMNS, ExportedDataset, describe_columns

CARD = "musync-export.json"


def describe_export(dataset: ExportedDataset, to: str) -> dict[str, Any]:
    """Return the content of ``musync-export.json``: run, seal, camera, units, and each clip's scenario and figures.

    Parameters
    ----------
    dataset : that is exported
    to : name of the format
    """
    variant = dataset.plan.settings.variant
    return {
        "format": to,
        "dataset": dataset.name,
        "run_id": dataset.manifest["run_id"],
        "seal": dataset.manifest["seal"],
        "variant": variant,
        **({"warning": warning} if (warning := warn_of_variant(variant)) else {}),
        "frame_rate_hz": dataset.frame_rate_hz,
        "camera": describe_camera(dataset.camera),
        "columns": describe_columns(TICK_COLUMNS),
        "clips": [
            {
                key: row[key]
                for key in ("index", "clip_id", "label", "split", "scenario", "figures", "verdict")
            }
            for row in dataset.rows
        ],
    }
