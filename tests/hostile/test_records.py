"""Manifests that a forger has sealed again: paths, ids, numbers and texts of other forms reach no file and no page."""

import json
from collections.abc import Callable
from typing import Any

import pytest

from tests.flows.reseal import reseal
from tests.hostile.stage import COMMANDS, LIGHT, endure, listing, refused, unrefused

TABLE = "telemetry/clips.parquet"
PATHS = {
    "absolute": "{victim}/id_rsa",
    "out of the folder": "../../victim/id_rsa",
    "out of the folder, from a folder within": "telemetry/../../../victim/id_rsa",
    "of the folder itself": ".",
    "empty": "",
    "with NUL": "telemetry/clips.parquet\0.txt",
    "with a backslash": "..\\..\\victim\\id_rsa",
    "of 5,000 characters": "telemetry/" + "x" * 5000,
    "of 5,000 folders": "telemetry/" + "x/" * 5000 + "x",
    "of look-alike letters": "telemetry/clips․parquet",
    "with a slash too many": "telemetry//clips.parquet",
    "with a folder that is none": "./telemetry/clips.parquet",
    "with a line break": "telemetry/clips.parquet\n",
    "of the home folder": "~/.bashrc",
    "of a remote address": "file:///etc/passwd",
    "with a glob": "telemetry/ticks/family=*/part-0000.parquet",
    "with half a surrogate": "telemetry/\ud800.parquet",
    "of a lock": ".staging/lock",
    "of a hidden file": "inputs/.bashrc",
}
CLIP_IDS = {
    "a path": "../../victim/id_rsa",
    "an absolute path": "{victim}/id_rsa",
    "a quote": "x' OR '1'='1",
    "a script's end": "</script><script>alert(1)</script>",
    "a line break": "0123456789abcde\n",
    "nothing": "",
    "too long": "a" * 5000,
    "a number": 17,
    "a list": ["0123456789abcdef"],
    "a glob": "*" * 16,
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
    "an input that is a path": lambda m: m["inputs"].update({"../../../victim/id_rsa": "0" * 64}),
    "an input that is absolute": lambda m: m["inputs"].update({"/etc/passwd": "0" * 64}),
    "a weather that is a path": set_scenario("weather", "../../x"),
    "a weather of its own": set_scenario("weather", "lava"),
    "a speed that is no number": set_scenario("initial_speed_km_h", "fast"),
    "a speed beyond all numbers": set_scenario("initial_speed_km_h", 1e308),
    "a seed that is text": set_clip("seed", "'; DROP"),
    "a clip that is none of the frames'": set_clip("index", 99),
    "a negative index": set_clip("index", -1),
    "a huge index": set_clip("index", 2**52),
    "an index that is a truth": set_clip("index", True),
    "an index twice": lambda m: m["clips"][1].update(index=0),
    "a label twice": lambda m: m["clips"][1].update(label=m["clips"][0]["label"]),
    "an id twice": lambda m: m["clips"][1].update(clip_id=m["clips"][0]["clip_id"]),
    "no clips": lambda m: m.update(clips=[]),
    "clips that are none": lambda m: m.update(clips=[None, 3, "x"]),
    "clips that are text": lambda m: m.update(clips="abc"),
    "a thousand million frames": set_grid("frames", 10**9),
    "frames without end": set_grid("frames", 2**52),
    "no frames": set_grid("frames", 0),
    "half a frame": set_grid("frames", 10.5),
    "no frame rate": set_grid("frame_rate_hz", 0),
    "a grid of nothing": lambda m: m.update(grid={}),
    "a grid that is a list": lambda m: m.update(grid=[]),
    "a scene that is a path": set_grid("scene", "/etc"),
    "a vehicle that is a path": set_grid("vehicle", "/etc/passwd"),
    "a scene's name that is a path": lambda m: m["scene"].update(name="../../victim"),
    "hashes that are none": lambda m: m["artifacts"].update({TABLE: "not a hash"}),
    "hashes that are numbers": lambda m: m["artifacts"].update({TABLE: 0}),
    "artifacts that are a list": lambda m: m.update(artifacts=[TABLE]),
    "names that differ in case": lambda m: m["artifacts"].update({"telemetry/Clips.parquet": "0" * 64}),
    "a file that is also a folder": lambda m: m["artifacts"].update({TABLE + "/x.parquet": "0" * 64}),
    "tables where none lie": lambda m: m["artifacts"].update({"telemetry/ticks/evil.parquet": "0" * 64}),
    "no tables": lambda m: m.update(artifacts={}),
    "no figures": set_clip("figures", {}),
    "figures that are lists": set_clip("figures", {"peak_pitch": [1] * 10}),
    "a verdict of its own": set_clip("verdict", {"passed": "yes", "reasons": "none"}),
    "a backend that is a command": lambda m: m.update(backend="; rm -rf ~"),
    "packages that are no list": lambda m: m.update(environment={"components": 7}),
    "a key of the future": lambda m: m.update(run_on_open="os.system"),
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
    "no text": b"\xff\xfe\x00",
    "Latin-1": '{"format": "é"}'.encode("latin-1"),
    "a list": b"[]",
    "null": b"null",
    "a hundred thousand brackets": b"[" * 100_000,
    "a hundred thousand tables": b'{"a":' * 100_000,
    "a number of a million digits": b'{"format": ' + b"9" * 1_000_000 + b"}",
    "a key twice": b'{"format": "musync-manifest/3", "format": "musync-manifest/3"}',
    "NaN": b'{"format": NaN}',
    "another format": b'{"format": "musync-manifest/99"}',
    "a format that is a table": b'{"format": {"a": [1, 2]}}',
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
