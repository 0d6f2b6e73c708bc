"""Arguments of the Python interface that no command line has checked."""

from collections.abc import Iterable, Sequence
from numbers import Integral

from catalogs.sentences import shorten_value
from tasks.errors import InputError


def is_whole(value: object) -> bool:
    """Return whether a value is a whole number, of Python or NumPy; True and False are none."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def list_names(argument: str, names: str | Sequence[str]) -> list[str]:
    """Return the names as a list; a single one may be given by itself.

    Parameters
    ----------
    argument : what messages call it
    names : a text, or some

    Raises
    ------
    InputError
        If it is neither a text nor a list of texts.
    """
    if isinstance(names, str):
        return [names]
    listed = list(names) if isinstance(names, Iterable) else [None]
    if not all(isinstance(name, str) for name in listed):
        raise InputError(f"{argument} must be a name or a list of names; it is {shorten_value(names)}")
    return listed
