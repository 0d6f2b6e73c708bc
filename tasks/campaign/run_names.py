"""Names in a sentence: the first few, and how many more there are."""

from collections.abc import Sequence

MOST_NAMES = 6
"""Names that a sentence lists [1]."""


def list_names(names: Sequence[str]) -> str:
    """Return names as a sentence lists them, such as "run-01, run-02 and 3 more".

    Parameters
    ----------
    names : of runs, or of places in files
    """
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return ", ".join(names[:MOST_NAMES]) + more
