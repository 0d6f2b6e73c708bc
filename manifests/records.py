"""The forms of plans, receipts, manifests and frozen runs, checked once, when they are read.

A dataset may come from a stranger. What passes here needs no second check: an id has the form of an id, and a recorded
path is one of those that muSync writes, below the dataset's folder.
"""

from collections.abc import Mapping, Sequence
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Annotated, Any, NotRequired, TypeVar, get_type_hints

from pydantic import AfterValidator, ConfigDict, Field, TypeAdapter, ValidationError, with_config
from typing_extensions import TypedDict

from catalogs.road_users import RoadUser
from catalogs.scenario import OPTIONAL_FIELDS, SCENARIO_FIELDS, Scenario
from catalogs.sentences import cap_problems, describe_rules, shorten_value
from manifests.canonical import ID_LENGTH
from tasks.conventions import CLIP_CHANNELS, SOME_CLIPS_CHANNELS
from tasks.errors import InputError
from tasks.eval.motion_agreement import PoseVerdict

LONGEST_TEXT = 1000
"""Of labels, names and versions; longer ones are no names."""
_NAME = r"[A-Za-z0-9_][A-Za-z0-9_.=-]{0,99}"

Id = Annotated[str, Field(pattern=rf"^[0-9a-f]{{{ID_LENGTH}}}$")]
Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Seed = Annotated[str, Field(pattern=r"^[0-9]{1,20}$")]
Text = Annotated[str, Field(max_length=LONGEST_TEXT, pattern=r"^\P{Cc}*$")]
Index = Annotated[int, Field(ge=0, lt=2**31)]
InputName = Annotated[str, Field(pattern=rf"^{_NAME}(/{_NAME}){{0,3}}$")]
"""Of a catalogue file below ``inputs/``."""
RecordedPath = Annotated[
    str, Field(pattern=rf"^(plan\.json|(inputs|frames\.zarr|telemetry|previews)(/{_NAME}){{1,9}})$")
]
"""Relative path of a file that muSync writes into a dataset: no ``..``, nothing hidden, nothing absolute."""


def _refuse_way_out(name: str) -> str:
    path = PurePosixPath(name)
    if path.is_absolute() or ".." in path.parts:
        raise ValueError(f"must not lead out of the folder of the run; it is {shorten_value(name)}")
    return name


LocalName = Annotated[Text, AfterValidator(_refuse_way_out)]

EVERY_INPUT = ("camera.yaml", "gates.yaml", "surface.yaml", "vehicle.yaml")
"""Catalogue files of every dataset, with frames or without."""
EVERY_TABLE = ("ticks", "frames")
"""Contents of every clip, with frames or without."""


def _require_keys(keys: tuple[str, ...]) -> AfterValidator:
    def check(found: dict[str, Any]) -> dict[str, Any]:
        if lacking := [key for key in keys if key not in found]:
            raise ValueError(f"must have the hash of {' and '.join(keys)}; it lacks {', '.join(lacking)}")
        return found

    return AfterValidator(check)


def _check_road_users(users: list[dict[str, Any]]) -> list[dict[str, Any]]:
    for user in users:
        RoadUser.model_validate(user)
    return users


_FIGURE_NAMES = {channel.name for channel in (*CLIP_CHANNELS, *SOME_CLIPS_CHANNELS)}
STRICT = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)

Inputs = Annotated[dict[InputName, Sha256], _require_keys(EVERY_INPUT)]
Content = Annotated[dict[Text, Sha256], _require_keys(EVERY_TABLE)]

if TYPE_CHECKING:  # their keys follow from what they record
    ScenarioRecord = dict[str, Any]
    FiguresRecord = dict[str, Any]
    VerdictRecord = dict[str, Any]
else:
    _fields = get_type_hints(Scenario, include_extras=True)
    _optional = {name: NotRequired[_fields[name]] for name in OPTIONAL_FIELDS}
    _users = Annotated[list[dict[str, Any]], AfterValidator(_check_road_users), Field(min_length=1)]
    ScenarioRecord = with_config(STRICT)(
        TypedDict(
            "ScenarioRecord",
            {**_fields, **_optional, "scene": NotRequired[LocalName], "objects": NotRequired[_users]},
        )
    )
    # a dataset decides what it has: a figure that came later is not represented
    _figures = {
        c.name: NotRequired[float | None]
        for c in (*CLIP_CHANNELS, *SOME_CLIPS_CHANNELS)
        if c.unit and c.name not in {*SCENARIO_FIELDS, *OPTIONAL_FIELDS}
    }
    FiguresRecord = with_config(STRICT)(
        TypedDict(
            "FiguresRecord",
            {**_figures, "calibration_extrapolated": bool, "collided": NotRequired[bool | None]},
        )
    )
    _checks = {name: NotRequired[kind | None] for name, kind in get_type_hints(PoseVerdict).items()}
    VerdictRecord = with_config(STRICT)(
        TypedDict("VerdictRecord", {**_checks, "passed": bool | None, "reasons": list[str]})
    )


@with_config(STRICT)
class SceneRecord(TypedDict):
    """Which scene: its name, and the SHA-256 of its content; of a street that is drawn, kind and seed."""

    name: LocalName
    sha256: Sha256
    kind: NotRequired[Text]
    seed: NotRequired[Index]


@with_config(STRICT)
class MadeWith(TypedDict):
    """Version and hash of the code, and versions of the libraries."""

    code: dict[Text, Text]
    libraries: dict[Text, Text]


@with_config(STRICT)
class GitCommit(TypedDict):
    """The commit of the source, and whether files of it were changed since."""

    commit: Annotated[str, Field(pattern=r"^[0-9a-f]{40,64}$")]
    changed: bool


@with_config(STRICT)
class ClipRecord(TypedDict):
    """A planned clip."""

    index: Index
    clip_id: Id
    label: Text
    seed: Seed
    scenario: ScenarioRecord
    split: Text
    calibration: Text


@with_config(STRICT)
class Receipt(ClipRecord):
    """A clip that is made: its files, the hashes of its decoded content, and what came out."""

    artifacts: dict[RecordedPath, Sha256]
    content: Content
    figures: FiguresRecord
    verdict: VerdictRecord


@with_config(STRICT)
class PlanRecord(TypedDict):
    """The content of ``plan.json``."""

    format: Text
    run_id: Id
    grid: dict[str, Any]
    scene: SceneRecord
    scenes: NotRequired[list[SceneRecord]]
    backend: Text
    inputs: Inputs
    made_with: MadeWith
    clips: list[ClipRecord]


@with_config(STRICT)
class ManifestHead(TypedDict):
    """The content of ``manifest.json`` without its clips; the form of ``grid`` is checked with the catalogue.

    ``processor``, ``git`` and ``environment`` say on what, from which commit and beside which packages the bytes were
    made: they decide nothing, and explain a difference.
    """

    format: Text
    run_id: Id
    grid: dict[str, Any]
    scene: SceneRecord
    scenes: NotRequired[list[SceneRecord]]
    backend: Text
    inputs: Inputs
    made_with: MadeWith
    processor: dict[Text, Text]
    git: "GitCommit | None"
    environment: dict[str, Any]
    artifacts: dict[RecordedPath, Sha256]
    seal: Sha256


@with_config(STRICT)
class Manifest(ManifestHead):
    """The content of ``manifest.json``."""

    clips: Annotated[list[Receipt], Field(min_length=1)]


@with_config(STRICT)
class FrozenClip(TypedDict):
    """A clip of a frozen run, with the hash of its telemetry."""

    label: Text
    seed: Seed
    scenario: ScenarioRecord
    split: Text
    calibration: Text
    ticks: Sha256


@with_config(STRICT)
class FrozenRun(TypedDict):
    """The content of the file of a frozen run."""

    format: Text
    name: Text
    grid: dict[str, Any]
    parameters: dict[InputName, Any]
    clips: Annotated[list[FrozenClip], Field(min_length=1)]
    scene: SceneRecord
    scenes: NotRequired[list[SceneRecord]]
    made_with: MadeWith
    processor: dict[Text, Text]
    seal: Sha256


Record = TypeVar("Record", Receipt, PlanRecord, ManifestHead, Manifest, FrozenRun)


def check_record(form: type[Record], value: Any, origin: object) -> Record:
    """A value that was read, in its form; numbers that canonical JSON shortens are floats again.

    Parameters
    ----------
    form : `Receipt`, `PlanRecord`, `ManifestHead`, `Manifest` or `FrozenRun`
    value : parsed JSON
    origin : what messages call it

    Raises
    ------
    InputError
        With what breaks the form, a sentence each.
    """
    try:
        record: Record = _ADAPTERS[form].validate_python(value)
    except ValidationError as error:
        uneven = [f"{origin}: {problem}" for problem in _find_uneven_figures(value)]
        raise InputError(cap_problems(uneven + describe_rules(error, origin))) from None
    problems = _find_clip_problems(value.get("clips", [])) + _find_input_problems(value)
    if problems := cap_problems(problems + _find_uneven_figures(value)):
        raise InputError([f"{origin}: {problem}" for problem in problems])
    return record


_ADAPTERS: dict[Any, TypeAdapter[Any]] = {
    form: TypeAdapter(form) for form in (Receipt, PlanRecord, ManifestHead, Manifest, FrozenRun)
}


def _find_uneven_figures(value: Any) -> list[str]:
    """Figures that some clips of one record have and others lack: one version makes all of its clips alike."""
    clips = value.get("clips") if isinstance(value, Mapping) else None
    held = {
        index: clip["figures"].keys() & _FIGURE_NAMES
        for index, clip in enumerate(clips if isinstance(clips, list) else [])
        if isinstance(clip, Mapping) and isinstance(clip.get("figures"), Mapping)
    }
    every: set[str] = set().union(*held.values())
    return [
        f"clips.{index}.figures.{name} is missing: other clips have it"
        for index, names in held.items()
        for name in sorted(every - names)
    ]


def _find_clip_problems(clips: Sequence[Mapping[str, Any]]) -> list[str]:
    """Rules that bind the clips of one record together."""
    rules = {
        "every clip must have a label of its own; some have the same": _are_distinct(clips, "label"),
        "every clip must have an id of its own; some have the same": _are_distinct(clips, "clip_id"),
        "the clips must stand in the order of their index, from 0; they do not": all(
            clip.get("index", index) == index for index, clip in enumerate(clips)
        ),
    }
    return [rule for rule, kept in rules.items() if not kept]


def _find_input_problems(record: Mapping[str, Any]) -> list[str]:
    """Inputs of a manifest whose two hashes, as an input and as a file, are not one."""
    if not {"inputs", "artifacts"} <= record.keys():
        return []
    return [
        f"inputs: {name} must have the hash that artifacts have of inputs/{name}; it is another"
        for name, digest in record["inputs"].items()
        if record["artifacts"].get(f"inputs/{name}") != digest
    ]


def _are_distinct(clips: Sequence[Mapping[str, Any]], key: str) -> bool:
    values = [clip[key] for clip in clips if key in clip]
    return len(set(values)) == len(values)
