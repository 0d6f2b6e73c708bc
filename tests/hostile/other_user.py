"""Somebody else on the same machine: code that runs as another user."""

import os
import pwd
import subprocess
import sys

import pytest

from manifests.provenance import SOURCE_ROOT

NOBODY = 65534


def run_as_other(attack: str, *words: str, imports: str = "") -> str:
    """Return what an attack prints, run as the user nobody; a test of a user who may not become that one is left out.

    Parameters
    ----------
    attack : Python; an exception becomes a line with its name
    words : in ``sys.argv`` from 1 on
    imports : what is imported before, which that user may not be able to read
    """
    if os.geteuid() != 0:
        pytest.skip("needs root, to become another user of this machine")
    try:
        user = pwd.getpwnam("nobody").pw_uid
    except KeyError:
        user = NOBODY
    body = "\n    ".join(attack.strip().splitlines())
    program = (
        f"import os, sys\n{imports}\nos.setgroups([])\nos.setgid({user})\nos.setuid({user})\n"
        f"try:\n    {body}\nexcept Exception as error:\n    print(type(error).__name__)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, *words], capture_output=True, text=True, timeout=60, check=False,
        cwd="/", env={"PATH": os.environ["PATH"], "PYTHONPATH": str(SOURCE_ROOT), "HOME": "/nonexistent"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout.strip()
