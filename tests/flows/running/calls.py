"""Calls that workers make: they import this module, and nothing of what the tests beside it need."""

import os


def square_or_fail(number: int) -> int:
    if number == 3:
        raise ValueError("three")
    return number * number


def tell_process_id(_: int) -> int:
    return os.getpid()


def end_worker(_: int) -> None:
    os._exit(1)


def list_variables(names: tuple[str, ...]) -> dict[str, str | None]:
    return {name: os.environ.get(name) for name in names}
