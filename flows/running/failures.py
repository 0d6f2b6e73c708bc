"""Failures that are neither the input's nor a bug's: clips that broke, and a disk that is full."""

import errno


class ClipsFailed(RuntimeError):
    """Some clips could not be made; the others are committed and kept."""


def disk_full_sentence(error: BaseException) -> str | None:
    """What to tell a user whose disk or quota is full; None for any other error."""
    if isinstance(error, OSError) and error.errno in {errno.ENOSPC, errno.EDQUOT}:
        place = f"{error.filename}: " if error.filename else ""
        return (
            f"{place}the disk is full; what is committed is kept: free space and run the same command again"
        )
    return None
