"""Formats that copy a dataset's own files take all of its clips."""

from flows.exporting.dataset import ExportedDataset
from tasks.errors import InputError


def require_every_clip(dataset: ExportedDataset, to: str) -> None:
    """Refuse a choice of clips.

    Parameters
    ----------
    dataset : to export
    to : name of the format

    Raises
    ------
    InputError
        If some of the clips are left out.
    """
    clips = dataset.manifest["clips"]
    if len(dataset) != len(clips):
        raise InputError(
            f"{dataset.layout}: --to {to} copies the dataset's own files and takes all {len(clips)} clips;"
            f" {len(dataset)} are asked for: name all of them with --clip where some are in quarantine"
        )
