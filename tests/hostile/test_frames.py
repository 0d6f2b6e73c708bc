"""Zarr from a stranger: no codec runs that muSync does not write, and no shape or shard costs memory or patience."""

import json
import os
import pickle
import resource
import shutil
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.flows.reseal import reseal
from tests.hostile.stage import Stage, endure, refused, unrefused

READS_PICTURES = ("open frames", "open windows", "sheets")


class Payload:
    """Unpickled, it makes a folder: who finds it has run a stranger's code."""

    def __init__(self, place: Path):
        self.place = str(place)

    def __reduce__(self) -> tuple[Callable[[str], None], tuple[str]]:
        return os.mkdir, (self.place,)


def edit(stage: Stage, member: str, change: Callable[[Any], object]) -> None:
    path = stage.dataset.frames / member / "zarr.json"
    metadata = json.loads(path.read_text())
    change(metadata)
    path.write_text(json.dumps(metadata))


def pickle_codec(stage: Stage) -> None:
    edit(stage, "rgb", lambda m: m.update(codecs=[{"name": "numcodecs.pickle", "configuration": {}}]))
    put_payload(stage, stage.dataset.frames / "rgb" / "c" / "0" / "0" / "0" / "0" / "0")


def zarr_2_with_pickle(stage: Stage) -> None:
    folder = stage.dataset.frames / "rgb"
    (folder / "zarr.json").unlink()
    (folder / ".zarray").write_text(json.dumps({
        "zarr_format": 2, "shape": [4, 5, 64, 96, 3], "chunks": [4, 5, 64, 96, 3], "dtype": "|O", "order": "C",
        "compressor": None, "filters": [{"id": "pickle"}], "fill_value": None,
    }))  # fmt: skip
    put_payload(stage, folder / "0.0.0.0.0")


def put_payload(stage: Stage, place: Path) -> None:
    place.write_bytes(pickle.dumps(Payload(stage.victim / "PWNED")))


def another_array(stage: Stage) -> None:
    shutil.copytree(stage.dataset.frames / "rgb", stage.dataset.frames / "evil")
    edit(stage, "evil", lambda m: m.update(codecs=[{"name": "numcodecs.pickle"}]))


def shard(metadata: Any) -> Any:
    return metadata["codecs"][0]["configuration"]


METADATA: dict[str, Callable[[Stage], object]] = {
    "the codec of pickles": pickle_codec,
    "the codec of pickles in Zarr 2": zarr_2_with_pickle,
    "the codec of pickles inside a shard": lambda s: edit(
        s, "rgb", lambda m: shard(m)["codecs"].insert(0, {"name": "numcodecs.pickle"})
    ),
    "an array that nobody knows": another_array,
    "pictures of Python objects": lambda s: edit(s, "rgb", lambda m: m.update(data_type="object")),
    "a remote store": lambda s: edit(
        s, "rgb", lambda m: m.update(storage_transformers=[{"name": "fsspec", "url": "file:///etc/passwd"}])
    ),
    "references to other files": lambda s: edit(
        s, "", lambda m: m.update(refs={"rgb/0": ["/etc/passwd", 0, 9]})
    ),
    "pictures of a million by a million": lambda s: edit(
        s, "rgb", lambda m: m["shape"].__setitem__(slice(2, 4), [10**6, 10**6])
    ),
    "a thousand million frames": lambda s: edit(s, "rgb", lambda m: m["shape"].__setitem__(1, 10**9)),
    "two sizes of pictures": lambda s: edit(s, "depth", lambda m: m["shape"].__setitem__(2, 32)),
    "no JSON": lambda s: (s.dataset.frames / "rgb" / "zarr.json").write_text("{" * 100_000),
}


@pytest.mark.parametrize("attack", METADATA)
def test_frames_with(stage, attack):
    METADATA[attack](stage)
    assert refused(endure(stage, "verify")["verify"])
    reseal(stage.dataset, lambda m: m["artifacts"].pop("frames.zarr/rgb/zarr.json", None)
           if attack.endswith("Zarr 2") else None)  # fmt: skip
    outcomes = endure(stage, *READS_PICTURES)
    # windows open the arrays that they were asked for, here rgb alone
    of_rgb = attack not in {
        "an array that nobody knows",
        "two sizes of pictures",
        "references to other files",
    }
    assert unrefused(outcomes, "open frames", *(["open windows"] if of_rgb else [])) == []


def test_attributes_of_frames_are_texts_and_nothing_more(stage):
    edit(stage, "rgb", lambda m: m["attributes"].update(
        units="seconds since the flood", _FillValue="x", scale_factor=[1], calendar="{}", coordinates="/etc"
    ))  # fmt: skip
    reseal(stage.dataset)
    outcomes = endure(stage, *READS_PICTURES, "audit")
    assert unrefused(outcomes, "open frames", "open windows") == []


SHARDS = {
    "its first half": lambda content: content[: len(content) // 2],
    "an index that leads far out": lambda content: (
        content[:-180] + struct.pack("<QQ", 2**62, 2**40) * 11 + content[-4:]
    ),
    "a pickle": lambda content: pickle.dumps(Payload(Path("/nowhere"))),
    "one flipped bit": lambda content: content[:50] + bytes([content[50] ^ 4]) + content[51:],
}


@pytest.mark.parametrize("attack", SHARDS)
def test_a_shard_that_holds(stage, attack):
    path = stage.dataset.frame_shard("rgb", 1)
    path.write_bytes(SHARDS[attack](path.read_bytes()))
    assert refused(endure(stage, "verify")["verify"])
    reseal(stage.dataset)
    outcomes = endure(stage, *READS_PICTURES, "preview")
    assert refused(outcomes["open windows"])


def test_a_picture_that_says_it_has_two_gigabytes_takes_no_such_memory(stage):
    path = stage.dataset.frame_shard("rgb", 1)
    content = bytearray(path.read_bytes())
    content[4:8] = struct.pack("<I", 2**31 - 17)  # Blosc's header of the first chunk: bytes when decompressed
    path.write_bytes(content)
    reseal(stage.dataset)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    endure(stage, *READS_PICTURES)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 500_000
