"""Manifests that a forger has sealed again: paths, ids, numbers and texts of other forms reach no file and no page."""

import json
from collections.abc import Callable
from typing import Any

import pytest

from tests.flows.reseal import reseal
from tests.hostile.stage import COMMANDS, LIGHT, endure, listing, refused, unrefused

TABLE = "telemetry/clips.parquet"
PATHS = {
    "out of the folder": "../../victim/id_rsa",
    "of 5,000 folders": "telemetry/" + "x/" * 5000 + "x",
    "with half a surrogate": "telemetry/\ud800.parquet",
    "of a lock": ".staging/lock",
}
CLIP_IDS = {
    "a path": "../../victim/id_rsa",
    "a script's end": "</script><script>alert(1)</script>",
    "a list": ["0123456789abcdef"],
}


def record_path(manifest: Any, recorded: str, of_clip: bool) -> None:
    holder = manifest["clips"][0] if of_clip else manifest
    holder["artifacts"][recorded] = "0" * 64


def set_clip(key: str, value: Any) -> Callable[[Any], None]:
    return lambda manifest: manifest["clips"][0].update({key: value})


def set_grid(key: str, value: Any) -> Callable[[Any], None]:
    return lambda manifest: manifest["grid"].update({key: value})


def set_scenario(key: str, value: Any) -> Callable[[Any], None]:
    return lambda manifest: manifest["clips"][0]["scenario"].update({key: value})


CHANGES: dict[str, Callable[[Any], Any]] = {
    "a run id that is a path": lambda m: m.update(run_id="../../victim/id_rsa"),
    "a speed beyond all numbers": set_scenario("initial_speed_km_h", 1e308),
    "an id twice": lambda m: m["clips"][1].update(clip_id=m["clips"][0]["clip_id"]),
    "a thousand million frames": set_grid("frames", 10**9),
    "frames without end": set_grid("frames", 2**52),
    "no frames": set_grid("frames", 0),
    "half a frame": set_grid("frames", 10.5),
    "no frame rate": set_grid("frame_rate_hz", 0),
    "a grid of nothing": lambda m: m.update(grid={}),
    "a scene that is a path": set_grid("scene", "/etc"),
    "a vehicle that is a path": set_grid("vehicle", "/etc/passwd"),
    "names that differ in case": lambda m: m["artifacts"].update({"telemetry/Clips.parquet": "0" * 64}),
    "a file that is also a folder": lambda m: m["artifacts"].update({TABLE + "/x.parquet": "0" * 64}),
    "tables where none lie": lambda m: m["artifacts"].update({"telemetry/ticks/evil.parquet": "0" * 64}),
    "a backend that is a command": lambda m: m.update(backend="; rm -rf ~"),
    "packages that are no list": lambda m: m.update(environment={"components": 7}),
    "Python in place of text": set_clip("label", "{0.__class__.__mro__}"),
}


@pytest.mark.parametrize("of_clip", [False, True], ids=["", "of a clip"])
@pytest.mark.parametrize("attack", PATHS)
def test_a_recorded_path(stage, attack, of_clip):
    recorded = PATHS[attack].format(victim=stage.victim)
    manifest = stage.manifest()
    record_path(manifest, recorded, of_clip)
    if "\ud800" in recorded:  # no bytes of a seal: JSON's escape is all that can say it
        stage.dataset.manifest.write_text(json.dumps(manifest))
    else:
        reseal(stage.dataset, lambda m: record_path(m, recorded, of_clip))
    outcomes = endure(stage, "verify", "describe", "repair", "audit", "sign")
    assert unrefused(outcomes) == []


@pytest.mark.parametrize("attack", CLIP_IDS)
def test_a_clip_id_that_is(stage, attack):
    value = CLIP_IDS[attack]
    value = value.format(victim=stage.victim) if isinstance(value, str) else value
    for record in (stage.dataset.manifest, stage.dataset.plan):
        content = json.loads(record.read_text())
        content["clips"][0]["clip_id"] = value
        record.write_text(json.dumps(content))
    reseal(stage.dataset)
    outcomes = endure(stage, *COMMANDS)
    assert unrefused(outcomes, "verify", "report", "audit", "repair", "sign") == []


@pytest.mark.parametrize("attack", CHANGES)
def test_a_manifest_with(stage, attack):
    reseal(stage.dataset, CHANGES[attack])
    before = listing(stage.dataset.root)
    outcomes = endure(stage, *LIGHT, "report")
    if refused(outcomes["describe"]):  # no record of a dataset: nobody writes into it
        assert listing(stage.dataset.root) == before


CONTENTS = {
    "nothing": b"",
    "a hundred thousand brackets": b"[" * 100_000,
    "another format": b'{"format": "musync-manifest/99"}',
    "colours of a terminal": b'{"format": "\\u001b[31m[/red]"}',
}


@pytest.mark.parametrize("place", ["manifest.json", "plan.json"])
@pytest.mark.parametrize("attack", CONTENTS)
def test_a_record_that_holds(stage, attack, place):
    (stage.dataset.root / place).write_bytes(CONTENTS[attack])
    before = listing(stage.dataset.root)
    outcomes = endure(stage, *(COMMANDS if place == "manifest.json" else ("verify", "explain", "generate")))
    assert refused(outcomes["verify"])
    if place == "manifest.json":
        assert (
            unrefused(outcomes, *(COMMANDS.keys() - {"gc", "gc --dry-run", "generate", "audit-physics"}))
            == []
        )
        assert listing(stage.dataset.root) == before


def test_a_seal_that_is_not_of_its_content(stage):
    content = stage.manifest()
    content["clips"][0]["label"] = "rain/flat"
    stage.dataset.manifest.write_text(json.dumps(content))
    outcomes = endure(stage, "verify", "audit", "repair", "sign")
    assert unrefused(outcomes) == []
