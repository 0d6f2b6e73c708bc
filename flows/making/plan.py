"""From a grid to a frozen plan: every clip with its content id and seed, before anything is made."""

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from catalogs.entries import load
from catalogs.grids import FaultyGrid, Grid, GridFile
from catalogs.grids.form import TICK_RATE_HZ
from catalogs.scenario import Scenario
from catalogs.vehicles import open_vehicle
from flows.making.grid_entries import recorded_settings
from flows.making.grid_inputs import read_grid_inputs
from flows.making.identity import identify_clip, identify_run, list_deciding, narrow_deciding
from flows.making.locations import note_location
from flows.store.layout import Layout
from flows.store.sealed import PLAN_FORMAT, read_plan_record, recorded_grid
from manifests.canonical import content_id, sha256_of
from manifests.explain import find_input_differences, find_value_differences, format_value
from manifests.provenance import code_version, library_versions
from manifests.records import Manifest, PlanRecord
from tasks.errors import InputError

_AS_WRITTEN: dict[str, Any] = {"indent": 1, "sort_keys": True, "allow_nan": False, "ensure_ascii": False}
_HELD: dict[Path, "Plan"] = {}
"""Plans of the runs of this process, which it need not read again."""


def frame_ticks(frames: int, frame_rate_hz: float) -> NDArray[np.int64]:
    """Return the tick that each frame shows [frames]: the nearest whole millisecond.

    Parameters
    ----------
    frames : of a clip [1]
    frame_rate_hz : [Hz]
    """
    return np.rint(np.arange(frames) * TICK_RATE_HZ / frame_rate_hz).astype(np.int64)


@dataclass(frozen=True, kw_only=True, slots=True)
class ClipPlan:
    """One clip to be made; ``calibration`` is its place in the calibrated range."""

    index: int
    clip_id: str
    label: str
    seed: str
    scenario: Scenario
    split: str
    calibration: str

    def as_json(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)} | {
            "scenario": self.scenario.as_record()
        }


@dataclass(frozen=True, kw_only=True)
class Plan:
    """All that decides a dataset's bytes; JSON in ``plan.json``."""

    run_id: str
    settings: GridFile
    scene: Mapping[str, Any]
    backend: str
    inputs: Mapping[str, str]
    made_with: Mapping[str, Any]
    clips: tuple[ClipPlan, ...]
    scenes: tuple[Mapping[str, Any], ...] = ()

    def record_of(self, scene: str | None) -> Mapping[str, Any]:
        """Return name and hash of a scene.

        Parameters
        ----------
        scene : as a scenario calls it; None is the dataset's one
        """
        return self.scene if scene is None else self._scenes_by_name[scene]

    @property
    def every_scene(self) -> tuple[Mapping[str, Any], ...]:
        """Name and hash of each scene that the clips drive in."""
        return self.scenes or (self.scene,)

    @cached_property
    def _scenes_by_name(self) -> dict[str, Mapping[str, Any]]:
        return {scene["name"]: scene for scene in self.scenes}

    @property
    def duration_s(self) -> float:
        """Length of the telemetry of every clip, from the first frame on [s]."""
        return self.settings.telemetry_s

    @property
    def ticks_per_clip(self) -> int:
        """Rows of every clip in the tick table, the first frame's among them [1]."""
        return self.settings.rows_per_clip["ticks"]

    def as_json(self) -> dict[str, Any]:
        return self.head_as_json() | {"clips": [clip.as_json() for clip in self.clips]}

    def head_as_json(self) -> dict[str, Any]:
        """The plan without its clips: the same few kilobytes whatever their number."""
        return {
            "format": PLAN_FORMAT,
            "run_id": self.run_id,
            "grid": self.settings.model_dump(mode="json"),
            "scene": dict(self.scene),
            **({"scenes": [dict(scene) for scene in self.scenes]} if self.scenes else {}),
            "backend": self.backend,
            "inputs": dict(self.inputs),
            "made_with": {key: dict(value) for key, value in self.made_with.items()},
        }

    def file_pieces(self) -> Iterator[bytes]:
        """Yield the bytes that `flows.store.layout.write_json` writes of `as_json`, a clip at a time."""
        empty = json.dumps(self.head_as_json() | {"clips": []}, **_AS_WRITTEN)
        # only a key of the plan itself stands behind a single space
        before, after = empty.split('\n "clips": []')
        yield f'{before}\n "clips": ['.encode()
        mark = "\n  "
        for clip in self.clips:
            yield (mark + json.dumps(clip.as_json(), **_AS_WRITTEN).replace("\n", "\n  ")).encode()
            mark = ",\n  "
        yield f"\n ]{after}\n".encode()

    @classmethod
    def of(cls, content: PlanRecord | Manifest, origin: object) -> "Plan":
        """A plan from its record, or from a manifest, whose clips say more; ``origin`` is what messages call it."""
        asked = [field.name for field in fields(ClipPlan)]
        clips: list[dict[str, Any]] = [{name: clip[name] for name in asked} for clip in content["clips"]]  # type: ignore[literal-required]
        return cls(
            run_id=content["run_id"],
            settings=recorded_grid(content["grid"], origin),
            scene=content["scene"],
            scenes=tuple(content.get("scenes", ())),
            backend=content["backend"],
            inputs=content["inputs"],
            made_with=content["made_with"],
            clips=tuple(ClipPlan(**clip | {"scenario": Scenario.of(clip["scenario"])}) for clip in clips),
        )


def make_plan(
    source: str | Path | Grid,
    backend: str,
    vehicle: str | None = None,
    *,
    pictures: bool | Literal["later"] = True,
) -> tuple[Plan, dict[str, bytes]]:
    """Check a grid against its catalogue entries and scene, and freeze it.

    Parameters
    ----------
    source : grid file, the name of one that ships, or a grid that is already read
    backend : rasteriser
    vehicle : takes the place of the grid's; a frozen one runs in the mode it was fitted in
    pictures : False makes telemetry alone, and ``later`` frames when they are read; True does as the grid says. The
        ids of the clips are the same

    Returns
    -------
    The plan, and the catalogue files it stands on (file name to bytes), to be kept with the dataset.

    Raises
    ------
    InputError
        Listing every problem at once.
    """
    try:
        grid = source if isinstance(source, Grid) else load("grid", source)
    except FaultyGrid as faults:
        behind = [] if faults.grid is None else read_grid_inputs(faults.grid, TICK_RATE_HZ)[2]
        raise InputError([*faults.problems, *(f"{source}: {problem}" for problem in behind)]) from None
    if vehicle is not None:
        grid = replace(grid, settings=_with_vehicle(grid.settings, vehicle))
    if pictures is not True:
        grid = replace(grid, settings=grid.settings.model_copy(update={"pictures": pictures}))
    name = source.settings.name if isinstance(source, Grid) else str(source)
    return freeze_grid(grid, name, backend)


def freeze_grid(grid: Grid, source: str, backend: str) -> tuple[Plan, dict[str, bytes]]:
    """`make_plan` of a grid that is already read; ``source`` is what messages call it."""
    settings = grid.settings
    entries, scenes, problems = read_grid_inputs(grid, TICK_RATE_HZ)
    if problems:
        raise InputError([f"{source}: {problem}" for problem in problems])
    hashes = {name: sha256_of([content]) for name, content in entries.contents.items()}
    several = tuple(scenes.values()) if None not in scenes else ()
    scene = next(iter(scenes.values()))
    deciding = list_deciding(settings, scene, hashes, backend, several)
    clips = tuple(_clip_plans(grid, deciding, scenes))
    repeated = {clip.label for clip in clips} if len({clip.clip_id for clip in clips}) < len(clips) else set()
    if repeated:
        raise InputError(
            f"{source}: two scenarios of a grid must differ; some of these are equal: {', '.join(sorted(repeated))}"
        )
    made_with = {"code": code_version(), "libraries": library_versions()}
    recorded = recorded_settings(settings)
    for name, (setting, path) in entries.files.items():
        if getattr(settings, setting) != getattr(recorded, setting):
            note_location(hashes[name], path)
    run_id = identify_run(
        deciding, recorded.model_dump(mode="json"), (clip.clip_id for clip in clips), made_with
    )
    plan = Plan(
        run_id=run_id,
        settings=recorded,
        scene=scene,
        scenes=several,
        backend=backend,
        inputs=hashes,
        made_with=made_with,
        clips=clips,
    )
    return plan, entries.contents


@contextmanager
def hold_plan(root: Path, plan: Plan) -> Iterator[None]:
    """Have `read_plan` return this plan for the length of a run, to every thread of this process.

    Parameters
    ----------
    root : of the dataset, whose ``plan.json`` holds the plan
    plan : that was written there
    """
    before = _HELD.get(root)
    _HELD[root] = plan
    try:
        yield
    finally:
        del _HELD[root]
        if before is not None:
            _HELD[root] = before


@lru_cache(maxsize=4)
def read_plan(root: Path) -> Plan:
    """The plan of a dataset.

    Raises
    ------
    InputError
        If there is none, or one of another format, or one that breaks a rule.
    """
    if (held := _HELD.get(root)) is not None:
        return held
    path = Layout(root).plan
    return Plan.of(read_plan_record(Layout(root)), path)


def plan_differences(
    theirs: Mapping[str, Any],
    ours: Mapping[str, Any],
    their_inputs: Mapping[str, bytes],
    our_inputs: Mapping[str, bytes],
) -> list[str]:
    """Where the plan of a dataset (theirs) and the one made here (ours) differ, to the value, a sentence each.

    Parameters
    ----------
    theirs, ours : plans as JSON
    their_inputs, our_inputs : catalogue files by their path under ``inputs/``
    """
    grid = [(f"grid.{path}", a, b) for path, a, b in find_value_differences(theirs["grid"], ours["grid"])]
    bare = [{**plan, "grid": {}} for plan in (theirs, ours)]
    rows = find_input_differences(bare[0], bare[1], their_inputs, our_inputs)
    rest = [(f"{row['input']} {row['path']}".strip(), row["a"], row["b"]) for row in rows]
    return [
        f"{field} is {format_value(a)} there and {format_value(b)} here" for field, a, b in (*grid, *rest)
    ]


def _with_vehicle(settings: GridFile, vehicle: str) -> GridFile:
    provenance = open_vehicle(vehicle).provenance
    mode = settings.vehicle_mode if provenance is None else provenance.mode
    return settings.model_copy(update={"vehicle": vehicle, "vehicle_mode": mode})


def _clip_plans(
    grid: Grid, deciding: Mapping[str, Any], scenes: Mapping[str | None, Mapping[str, Any]]
) -> Iterator[ClipPlan]:
    """The clips of a grid: its scenarios, each under every visual seed."""
    own = {name: narrow_deciding(deciding, scene) for name, scene in scenes.items()}
    seeds = range(grid.settings.seed, grid.settings.seed + grid.settings.visual_seeds)
    named = [(label, scenario, tags, seed) for (label, scenario), tags in zip(grid.scenarios, grid.tags, strict=True)
             for seed in seeds]  # fmt: skip
    for index, (label, scenario, (split, calibration), grid_seed) in enumerate(named):
        row = scenario.as_row()
        seed = derive_seed(grid_seed, row)
        yield ClipPlan(
            index=index,
            clip_id=identify_clip(own[scenario.scene], scenario.as_record(), seed),
            label=name_clip(label, grid_seed, len(seeds)),
            seed=seed,
            scenario=scenario,
            split=split,
            calibration=calibration,
        )


def derive_seed(grid_seed: int, scenario: Mapping[str, Any]) -> str:
    """Return the visual seed of a clip.

    It follows the scenario, not its place in the grid, so that a longer grid repeats its clips; and not the road
    feature, so that a feature clip and its flat twin share every drop and every patch of snow.

    Parameters
    ----------
    grid_seed : one of the grid's visual seeds [1]
    scenario : of the clip
    """
    seen = {name: value for name, value in scenario.items() if not name.startswith("hazard_")}
    return str(int(sha256_of([f"{grid_seed}/{content_id(seen)}".encode()])[:16], 16))


def name_clip(label: str, grid_seed: int, seeds: int) -> str:
    """Return the label of a clip.

    Parameters
    ----------
    label : of its scenario
    grid_seed : its visual seed, as the grid counts them [1]
    seeds : visual seeds of the grid [1]
    """
    return label if seeds == 1 else f"{label}/seed-{grid_seed}"
