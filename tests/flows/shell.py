"""A command of ``musync``, run in this process as the shell would."""

import pytest

from flows import cli


def run_command(monkeypatch: pytest.MonkeyPatch, *words: str) -> int:
    """Exit code of ``musync WORDS``; what it prints goes to the streams that pytest captures."""
    monkeypatch.setattr("sys.argv", ["musync", *words])
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    for name, value in cli.SETTINGS.items():
        monkeypatch.setenv(name, value)
    with pytest.raises(SystemExit) as end:
        cli.main()
    return 0 if end.value.code is None else int(end.value.code)
