"""Channel maps: how a logger's signals become the channels and runs of a campaign."""

from collections.abc import Iterable
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, Literal, TypeVar

from pydantic import AfterValidator, Field, ValidationError, ValidationInfo, field_validator

from catalogs.channel_maps.conditions import Conditions, find_condition_problems
from catalogs.channel_maps.text_files import CsvEntry
from catalogs.channel_maps.tolerances import Tolerances
from catalogs.documents import parse_yaml
from catalogs.names import LONGEST_NAME
from catalogs.quantities import CatalogueEntry, Number, Text
from catalogs.sentences import cap_problems, describe_rules, shorten, shorten_value
from tasks.campaign.channels import CHANNELS_BY_NAME, MAIN_CHANNELS, UNITS, SpeedSource, describe_wheel_gain
from tasks.campaign.clocks import TIME_OF_DAY
from tasks.campaign.signals import ChannelRule, Gain
from tasks.errors import InputError

HIGHEST_RATE = 1_000_000.0
"""Of a campaign [Hz]: a thousand times what a vehicle's bus gives."""
MAIN_NAMES = tuple(channel.name for channel in MAIN_CHANNELS)
Part = Literal["train", "held_out"]
Kept = TypeVar("Kept")
Entry = TypeVar("Entry", bound=CatalogueEntry)
LONGEST_DELAY = 2.0
"""By which a time stamp is late [s]: loggers and GPS receivers take some tenths; 50 is a delay in ms."""


def _check_delay(delay: float) -> float:
    if abs(delay) > LONGEST_DELAY:
        raise ValueError(f"must be a delay in seconds, at most {LONGEST_DELAY:g} either way; it is {delay:g}")
    return delay


def _check_scale(scale: float) -> float:
    if scale == 0.0:
        raise ValueError("must not be 0, which makes every sample the same; leave it away for 1")
    return scale


Factor = Annotated[Number, AfterValidator(_check_scale)]


class GainEntry(CatalogueEntry):
    """A change of quantity, such as torque to pressure; ``unit`` is that of the result."""

    value: Factor
    unit: Text
    source: Text


class ChannelEntry(CatalogueEntry):
    """Where one channel comes from; the meanings are given by ``ChannelRule``.

    Without ``unit`` the file's is taken. ``values`` says for what number a logged text or number stands, None for no
    value.
    """

    source: Text | Annotated[tuple[Text, ...], Field(min_length=1)]
    unit: Text | None = None
    sign: Literal[1, -1] = 1
    scale: Factor = 1.0
    offset: Number = 0.0
    delay_s: Annotated[Number, AfterValidator(_check_delay)] = 0.0
    gain: GainEntry | None = None
    values: dict[str, Number | None] = Field(default_factory=dict)
    note: str = ""

    def rule(self, channel: str) -> ChannelRule:
        """The same for the science floor."""
        sources = (self.source,) if isinstance(self.source, str) else self.source
        gain = None
        if self.gain is not None:
            gain = Gain(value=self.gain.value, source_unit=self.unit or "", target_unit=self.gain.unit)
        return ChannelRule(
            channel=channel, sources=sources, unit=self.unit or "", sign=self.sign, scale=self.scale,
            offset=self.offset, delay=self.delay_s, gain=gain,
        )  # fmt: skip


class TimeEntry(CatalogueEntry):
    """The clock's column, and what to do with samples of one time stamp; MDF4 has a clock per signal."""

    source: Text
    unit: Text = "s"
    repeats: Literal["refuse", "keep_first"] = "refuse"

    @field_validator("unit")
    @classmethod
    def _is_of_time(cls, unit: str) -> str:
        if unit != TIME_OF_DAY and UNITS.get(unit, ("", 0.0))[0] != "time":
            raise ValueError(f"time unit must be one of s, ms, us, ns, {TIME_OF_DAY}; it is {unit}")
        return unit


def _check_inside(file: str) -> str:
    path = PurePosixPath(file)
    if path.is_absolute() or ".." in path.parts or not path.name or not file.isprintable():
        raise ValueError(f"must be a file in the folder of the measurements; it is {shorten_value(file)}")
    return file


class RunEntry(CatalogueEntry):
    """One run: a stretch of one file in the logger's time, with what differs from the common conditions."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=LONGEST_NAME)]
    file: Annotated[Text, AfterValidator(_check_inside)]
    from_s: Number | None = None
    to_s: Number | None = None
    part: Part = "train"
    conditions: dict[str, Any] = Field(default_factory=dict)

    @field_validator("conditions")
    @classmethod
    def _are_conditions(cls, conditions: dict[str, Any]) -> dict[str, Any]:
        Conditions.model_validate(conditions)
        return conditions


class SegmentEntry(CatalogueEntry):
    """Cut every file into one run per brake application; every n-th of them is held out."""

    above_mpa: Annotated[float, Field(strict=True, gt=0)]
    merge_gap_s: Annotated[float, Field(strict=True, ge=0)]
    minimum_s: Annotated[float, Field(strict=True, ge=0)]
    before_s: Annotated[float, Field(strict=True, ge=0)]
    after_s: Annotated[float, Field(strict=True, ge=0)]
    held_out_every: Annotated[int, Field(strict=True, ge=2)]


class ChannelMap(CatalogueEntry):
    """Content of a channel map file. Without ``runs`` and ``segment`` every file is one run."""

    campaign: Text
    vehicle: Text
    source: Text
    sample_rate_hz: Annotated[float, Field(strict=True, gt=0, le=HIGHEST_RATE)]
    time: TimeEntry | None = None
    csv: CsvEntry = CsvEntry()
    channels: dict[str, ChannelEntry]
    not_measured: Annotated[tuple[str, ...], Field(validate_default=True)] = ()
    speed_from: SpeedSource = "ground"
    conditions: Conditions = Conditions()
    runs: Annotated[tuple[RunEntry, ...], Field(validate_default=True)] = ()
    segment: SegmentEntry | None = None
    tolerances_1sigma: Tolerances = Field(default_factory=Tolerances)
    notes: str = ""

    @property
    def rules(self) -> tuple[ChannelRule, ...]:
        """The channels for the science floor, in the map's order."""
        return tuple(entry.rule(name) for name, entry in self.channels.items())

    def meanings_of(self, signal: str) -> dict[str, float | None]:
        """Return for what number each text or number of a signal stands, None for no value."""
        return {
            word: number
            for channel, entry in self.channels.items()
            if signal in entry.rule(channel).sources
            for word, number in entry.values.items()
        }

    def conditions_of(self, run: RunEntry) -> Conditions:
        """The common conditions with the run's own laid over them."""
        return _lay_over(self.conditions, run)

    @field_validator("channels")
    @classmethod
    def _channels_exist_in_their_unit(cls, channels: dict[str, ChannelEntry]) -> dict[str, ChannelEntry]:
        problems = _unknown_channels(channels)
        for name, entry in channels.items():
            if name in CHANNELS_BY_NAME and entry.unit is not None:
                try:
                    _ = entry.rule(name).factor
                except InputError as error:
                    problems += [
                        f"channel {name}: {problem}{describe_wheel_gain(name, entry.unit)}"
                        for problem in error.problems
                    ]
        compared = [name for name in MAIN_NAMES if name in channels]
        given = [(source, name) for name in compared for source in channels[name].rule(name).sources]
        for signal in dict.fromkeys(source for source, _ in given):
            names = [name for source, name in given if source == signal]
            if len(names) > 1:
                problems.append(
                    f"signal {shorten(signal, 60)} must be one measurement; it stands for {', '.join(names)}: correct a"
                    " source, or list a channel under not_measured"
                )
        return _raise_problems(channels, problems)

    @field_validator("not_measured")
    @classmethod
    def _every_main_channel_has_its_place(
        cls, names: tuple[str, ...], info: ValidationInfo
    ) -> tuple[str, ...]:
        problems = _unknown_channels(names)
        if "channels" in info.data:
            problems += [
                f"channel {channel.name} must stand either in channels or in not_measured: the map must say where it"
                " is or that there is none"
                for channel in MAIN_CHANNELS
                if (channel.name in info.data["channels"]) == (channel.name in names)
            ]
        return _raise_problems(names, problems)

    @field_validator("runs")
    @classmethod
    def _runs_stand_once_in_weather_that_there_is(
        cls, runs: tuple[RunEntry, ...], info: ValidationInfo
    ) -> tuple[RunEntry, ...]:
        names = [run.name for run in runs]
        problems = [f"run {name} stands twice" for name in sorted({n for n in names if names.count(n) > 1})]
        if (common := info.data.get("conditions")) is not None:
            laid = {f"run {run.name}": _lay_over(common, run) for run in runs} or {"conditions": common}
            problems += [
                f"{key_path}: {problem}"
                for key_path, conditions in laid.items()
                for problem in find_condition_problems(conditions.model_dump())
            ]
        return _raise_problems(runs, problems)

    @field_validator("segment")
    @classmethod
    def _is_in_place_of_runs(cls, segment: SegmentEntry | None, info: ValidationInfo) -> SegmentEntry | None:
        both = segment is not None and bool(info.data.get("runs"))
        return _raise_problems(
            segment, ["a map has either runs or segment; this one has both"] if both else []
        )


class FaultyMap(InputError):
    """A channel map that breaks rules.

    Parameters
    ----------
    problems : one sentence each
    readable : what it says of signals, so that these can be looked up in the recordings all the same; None if nothing
    """

    def __init__(self, problems: list[str], readable: ChannelMap | None):
        super().__init__(problems)
        self.readable = readable


def _lay_over(common: Conditions, run: RunEntry) -> Conditions:
    return Conditions.model_validate(common.model_dump(exclude_unset=True) | run.conditions)


def _unknown_channels(names: Iterable[str]) -> list[str]:
    return [
        f"channel {shorten(name, 60)}: no such channel; there are: {', '.join(CHANNELS_BY_NAME)}"
        for name in names
        if name not in CHANNELS_BY_NAME
    ]


def _raise_problems(value: Kept, problems: list[str]) -> Kept:
    if problems:
        raise ValueError("; ".join(problems))
    return value


def build_channel_map(content: bytes, origin: Path) -> tuple[ChannelMap, Path]:
    """Return the map that a YAML file holds; also the file.

    Parameters
    ----------
    content, origin : of the file

    Raises
    ------
    InputError
        If it is no YAML.
    FaultyMap
        Listing every problem of the file.
    """
    table = parse_yaml(content, origin, "channel map", finite=False)
    try:
        return ChannelMap.model_validate(table), origin
    except ValidationError as error:
        raise FaultyMap(cap_problems(describe_rules(error, origin)), _readable_part(table)) from None


def _readable_part(content: dict[str, Any]) -> ChannelMap | None:
    """The signals, the clock, the runs and the form of text files, where they can be read by themselves."""
    named = content.get("channels")
    channels = {
        name: entry
        for name, given in (named if isinstance(named, dict) else {}).items()
        if (entry := _read_part(ChannelEntry, given)) is not None
    }
    time, csv = _read_part(TimeEntry, content.get("time")), _read_part(CsvEntry, content.get("csv", {}))
    listed = content.get("runs", [])
    runs = [_read_part(RunEntry, given) for given in listed] if isinstance(listed, list) else [None]
    if csv is None or None in runs or (time is None and "time" in content):
        return None
    return ChannelMap.model_construct(channels=channels, time=time, csv=csv, runs=tuple(runs))


def _read_part(model: type[Entry], content: object) -> Entry | None:
    try:
        return model.model_validate(content)
    except ValidationError:
        return None
