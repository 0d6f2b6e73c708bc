"""Channel maps: how a logger's signals become the channels and runs of a campaign."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from catalogs.entries import find_entry
from catalogs.quantities import CatalogueEntry, Number, Text, read_entry
from tasks.errors import InputError
from tasks.recordings.channels import CHANNELS_BY_NAME, MAIN_CHANNELS, UNITS
from tasks.recordings.signals import ChannelRule, Gain

FOLDER = Path(__file__).parent
Part = Literal["train", "held_out"]
Sigma = Annotated[float, Field(strict=True, gt=0)]


class GainEntry(CatalogueEntry):
    """A change of quantity, such as torque to pressure; ``unit`` is that of the result."""

    value: Number
    unit: Text
    source: Text


class ChannelEntry(CatalogueEntry):
    """Where one channel comes from; the meanings stand at ``ChannelRule``."""

    source: Text | Annotated[tuple[Text, ...], Field(min_length=1)]
    unit: Text
    sign: Literal[1, -1] = 1
    scale: Number = 1.0
    offset: Number = 0.0
    delay_s: Number = 0.0
    gain: GainEntry | None = None
    note: str = ""

    def rule(self, channel: str) -> ChannelRule:
        """The same for the science floor."""
        sources = (self.source,) if isinstance(self.source, str) else self.source
        gain = None
        if self.gain is not None:
            gain = Gain(value=self.gain.value, source_unit=self.unit, target_unit=self.gain.unit)
        return ChannelRule(
            channel=channel, sources=sources, unit=self.unit, sign=self.sign, scale=self.scale,
            offset=self.offset, delay=self.delay_s, gain=gain,
        )  # fmt: skip


class TimeEntry(CatalogueEntry):
    """The clock's column, and what to do with samples of one time stamp; MDF4 has a clock per signal."""

    source: Text
    unit: Text = "s"
    repeats: Literal["refuse", "keep_first"] = "refuse"


class Conditions(CatalogueEntry):
    """What the logger does not know of a run; the columns of runs.csv."""

    weather: Literal["dry", "rain", "snow"] = "dry"
    precipitation_mm_h: Number = 0.0
    snow_accumulation_h: Number = 0.0
    direction: Literal[1, -1] = 1
    disc_temperature_above_ambient_c: Number = 0.0
    hazard_center_m: Number = 0.0
    hazard_length_m: Number = 0.0
    hazard_height_m: Number = 0.0


class RunEntry(CatalogueEntry):
    """One run: a stretch of one file in the logger's time, with what differs from the common conditions."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")]
    file: Text
    from_s: Number | None = None
    to_s: Number | None = None
    part: Part = "train"
    conditions: dict[str, Any] = Field(default_factory=dict)


class SegmentEntry(CatalogueEntry):
    """Cut every file into one run per brake application; every n-th of them is held out."""

    above_mpa: Annotated[float, Field(strict=True, gt=0)]
    merge_gap_s: Annotated[float, Field(strict=True, ge=0)]
    minimum_s: Annotated[float, Field(strict=True, ge=0)]
    before_s: Annotated[float, Field(strict=True, ge=0)]
    after_s: Annotated[float, Field(strict=True, ge=0)]
    held_out_every: Annotated[int, Field(strict=True, ge=2)]


class RunTolerances(CatalogueEntry):
    """One-sigma doubts about a single run."""

    initial_speed_m_s: Sigma
    friction: Sigma
    acceleration_bias_m_s2: Sigma
    pitch_offset_deg: Sigma


class Tolerances(CatalogueEntry):
    """One-sigma doubts about a session, relative save the grade."""

    pressure_gain: Sigma
    mass: Sigma
    pitch_gain: Sigma
    wheel_radius: Sigma
    suspension_damping: Sigma
    suspension_stiffness: Sigma
    grade: Sigma
    run: RunTolerances


class CsvEntry(CatalogueEntry):
    """How text files are written."""

    separator: Text = ","
    decimal: Literal[".", ","] = "."
    skip_rows: Annotated[int, Field(strict=True, ge=0)] = 0


class ChannelMap(CatalogueEntry):
    """What a map file holds. Without ``runs`` and ``segment`` every file is one run."""

    campaign: Text
    vehicle: Text
    source: Text
    sample_rate_hz: Annotated[float, Field(strict=True, gt=0)]
    time: TimeEntry | None = None
    csv: CsvEntry = CsvEntry()
    channels: dict[str, ChannelEntry]
    not_measured: tuple[str, ...] = ()
    conditions: Conditions = Conditions()
    runs: tuple[RunEntry, ...] = ()
    segment: SegmentEntry | None = None
    tolerances_1sigma: Tolerances
    notes: str = ""

    @property
    def rules(self) -> tuple[ChannelRule, ...]:
        """The channels for the science floor, in the map's order."""
        return tuple(entry.rule(name) for name, entry in self.channels.items())

    def conditions_of(self, run: RunEntry) -> Conditions:
        """The common conditions with the run's own laid over them."""
        return Conditions.model_validate(self.conditions.model_dump() | run.conditions)

    @model_validator(mode="after")
    def _keeps_its_rules(self) -> "ChannelMap":
        problems = []
        for name in (*self.channels, *self.not_measured):
            if name not in CHANNELS_BY_NAME:
                problems.append(f"channel {name}: no such channel; there are: {', '.join(CHANNELS_BY_NAME)}")
        for name, entry in self.channels.items():
            if name in CHANNELS_BY_NAME:
                try:
                    _ = entry.rule(name).factor
                except InputError as error:
                    problems += [f"channel {name}: {problem}" for problem in error.problems]
        for channel in MAIN_CHANNELS:
            if (channel.name in self.channels) == (channel.name in self.not_measured):
                problems.append(
                    f"channel {channel.name} must stand either in channels or in not_measured: the map must say"
                    " where it is or that there is none"
                )
        if self.time is not None and UNITS.get(self.time.unit, ("", 0.0))[0] != "time":
            problems.append(f"time unit must be one of s, ms, us, ns; it is {self.time.unit}")
        if self.runs and self.segment is not None:
            problems.append("a map has either runs or segment; this one has both")
        names = [run.name for run in self.runs]
        problems += [f"run {name} stands twice" for name in sorted({n for n in names if names.count(n) > 1})]
        for run in self.runs:
            try:
                self.conditions_of(run)
            except ValueError as error:
                problems.append(f"run {run.name}: conditions: {' '.join(str(error).split())[:200]}")
        if problems:
            raise ValueError("; ".join(problems))
        return self


def load_channel_map(name_or_path: str | Path) -> tuple[ChannelMap, Path]:
    """Read a map by its name in the catalogue or from a YAML file; also the file.

    Raises
    ------
    InputError
        Listing every problem of the file, or the maps that exist.
    """
    path = find_entry(FOLDER, name_or_path, "channel map")
    return read_entry(ChannelMap, path, "channel map"), path
