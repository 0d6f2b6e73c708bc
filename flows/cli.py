"""The ``musync`` command: reads arguments, calls one function, prints what it returned."""

import sys

import typer

from flows.commands import audits, datasets, judging, measured, scenes, studies
from flows.commands.console import BROKEN, INPUT_WRONG
from tasks.errors import InputError

app = typer.Typer(add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False, help=__doc__)
for group in (datasets, audits, judging, studies, measured, scenes):
    app.add_typer(group.app)


def main() -> None:
    """Entry point: exit codes 0 done, 1 a check failed, 2 the input is wrong, 3 something broke."""
    from flows.running.failures import ClipsFailed, disk_full_sentence

    try:
        app(standalone_mode=True)
    except InputError as error:
        for problem in error.problems:
            print(f"musync: {problem}", file=sys.stderr)
        sys.exit(INPUT_WRONG)
    except ClipsFailed as error:
        print(f"musync: {error}", file=sys.stderr)
        sys.exit(BROKEN)
    except OSError as error:
        sentence = disk_full_sentence(error)
        if sentence is None:
            raise
        print(f"musync: {sentence}", file=sys.stderr)
        sys.exit(INPUT_WRONG)


if __name__ == "__main__":
    main()
