"""Arrays of a stranger's scene are read from regular files alone."""

import os
from pathlib import Path

import pytest

from catalogs.scenes.array_files import open_regular
from tasks.errors import InputError


@pytest.mark.parametrize(
    ("put", "said"),
    [
        (os.mkfifo, "must be a regular file; it is none"),
        (Path.mkdir, "must be a regular file; it is none"),
        (lambda path: path.symlink_to(__file__), "must be a regular file, and no link"),
        (lambda path: None, "must be a regular file, and no link; No such file"),
    ],
    ids=["a pipe", "a folder", "a link", "nothing"],
)
def test_what_is_no_regular_file_is_refused_and_not_waited_for(tmp_path, put, said):
    put(tmp_path / "means.npy")
    before = len(os.listdir("/dev/fd"))
    with pytest.raises(InputError, match=said):
        open_regular(tmp_path / "means.npy")
    assert len(os.listdir("/dev/fd")) == before


def test_a_regular_file_is_read(tmp_path):
    (tmp_path / "means.npy").write_bytes(b"numbers")
    with open_regular(tmp_path / "means.npy") as stream:
        assert stream.read() == b"numbers"
