"""The ``musync`` command, and how it ends."""

import os
import sys

from flows.parser import build_parser
from flows.running.failures import INTERRUPTED, explain_end
from flows.running.terminal import print_lines

QUIET = {"OPENCV_FFMPEG_LOGLEVEL": "-8", "OPENCV_LOG_LEVEL": "ERROR"}
"""OpenCV would print names and tags of a video unescaped; muSync reports faults of a video itself."""

app = build_parser()


def main() -> None:
    """Entry point: exit codes 0 done, 1 a check failed, 2 the input is wrong, 3 something broke, 130 interrupted."""
    for name, value in QUIET.items():
        os.environ.setdefault(name, value)
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]  # a terminal that knows ASCII only
    try:
        app()
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
