"""A run is late that begins long after its time, or still goes on when the next one is due."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from threading import Timer

LATE_AFTER = timedelta(minutes=10)
"""Between the time of a run and its beginning."""


@contextmanager
def watch_lateness(at: datetime, next_at: datetime | None, tell: Callable[[str], object]) -> Iterator[None]:
    """Tell, once, of a run that is late while the block makes it.

    Parameters
    ----------
    at : scheduled time of the run
    next_at : of the next run; None where none is planned
    tell : called with a sentence, from another thread where the next run falls due
    """
    now = datetime.now(UTC)
    if now - at > LATE_AFTER:
        late_min = (now - at).total_seconds() / 60
        tell(f"it was due at {_format(at)} and began {late_min:.0f} min later")
        next_at = None
    if next_at is None or next_at <= now:
        yield
        return
    sentence = (
        f"it was due at {_format(at)} and still goes on at {_format(next_at)}, when the next run is due"
    )
    timer = Timer((next_at - now).total_seconds(), tell, [sentence])
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def _format(at: datetime) -> str:
    return f"{at.astimezone(UTC):%Y-%m-%d %H:%M} UTC"
