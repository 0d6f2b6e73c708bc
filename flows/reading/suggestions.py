"""The sentence for a name that does not exist: which ones come near, and what lists them all."""

from collections.abc import Sequence
from difflib import get_close_matches

from catalogs.sentences import cap_problems, shorten, shorten_value
from tasks.errors import InputError

MOST_COMPARED = 2000
"""Names that a wrong one is compared with [1]: comparing takes some 20 microseconds each."""
_SHOWN = 5


def suggest_names(what: str, wrong: Sequence[object], known: Sequence[str], lister: str) -> InputError:
    """Return the error for names that do not exist, one sentence each.

    Parameters
    ----------
    what : kind of the names, such as "column"
    wrong : names as the user gave them
    known : names that exist; not empty
    lister : how to see them all
    """
    return InputError(cap_problems([_describe(what, name, known, lister) for name in wrong]))


def suggest_clips(
    origin: object, wrong: Sequence[object], labels: Sequence[str], lister: str = "musync lab describe"
) -> InputError:
    """Return the error for clips that a dataset does not have, one sentence each.

    Parameters
    ----------
    origin : what messages call the dataset
    wrong : labels or ids as the user gave them
    labels : of its clips
    lister : how to see them all
    """
    return suggest_names(f"{origin}: clip", wrong, labels, lister)


def _describe(what: str, name: object, known: Sequence[str], lister: str) -> str:
    near = get_close_matches(str(name)[:200], known[:MOST_COMPARED], n=_SHOWN, cutoff=0.5)
    listed = ", ".join(shorten(other, 60) for other in near or known[:_SHOWN])
    return (
        f"{what} {shorten_value(name)}: there is none of this name;"
        f" {'near it' if near else 'the first'}: {listed}; {lister} has all {len(known)}"
    )
