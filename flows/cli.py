"""The ``musync`` command, and how it ends."""

import os
import sys
from collections.abc import Callable

from flows.parser import build_parser
from flows.running.failures import INTERRUPTED, explain_end
from flows.running.terminal import print_lines

SETTINGS = {"OPENCV_FFMPEG_LOGLEVEL": "-8", "OPENCV_LOG_LEVEL": "ERROR", "PYTHONSAFEPATH": "1"}
"""OpenCV would print names and tags of a video unescaped; muSync reports faults of a video itself. Worker processes
would run a multiprocessing.py that lies in the working folder."""

app = build_parser()


def main() -> None:
    """Entry point: exit codes 0 done, 1 a check failed, 2 the input is wrong, 3 something broke, 130 interrupted."""
    for name, value in SETTINGS.items():
        os.environ.setdefault(name, value)
    run_to_end(app)


def run_to_end(run: Callable[[], object]) -> None:
    """Run a program of this project, whose failures become the exit codes and sentences of ``musync``.

    Parameters
    ----------
    run : what ``musync`` or ``python -m benchmarks.NAME`` does
    """
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]  # a terminal that knows ASCII only
    try:
        run()
    except SystemExit as end:
        if end.code != INTERRUPTED:
            raise
        _end_with(KeyboardInterrupt())
    except BaseException as error:
        _end_with(error)


def _end_with(error: BaseException) -> None:
    code, sentences = explain_end(error, sys.argv[1:])
    for sentence in sentences:
        # a sentence of several lines is indented, so that no line of it looks like one of its own
        print_lines("musync: " + sentence.replace("\n", "\n  "), error=True)
    sys.exit(code)


if __name__ == "__main__":
    main()
