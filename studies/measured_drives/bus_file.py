"""Vehicle buses to emit: signals with rate, resolution and noise, and the drives that they carry."""

from typing import Annotated

from pydantic import Field, field_validator, model_validator

from catalogs.quantities import CatalogueEntry, Scalar, Table, Text, require_quantity
from studies.measured_drives.brake_dive import DiveModel
from studies.measured_drives.bus_drive import Bus, BusSignal, DriveStyle
from tasks.campaign.channels import CHANNELS_BY_NAME, unit_factor

Positive = Annotated[float, Field(strict=True, gt=0)]
Share = Annotated[Scalar, require_quantity("1", minimum=0, maximum=1)]
Ratio = Annotated[Scalar, require_quantity("1", above=0)]
Seconds = Annotated[Table, require_quantity("s", above=0)]


class TruthEntry(CatalogueEntry):
    """The car that drives; the meanings are given by ``DiveModel``."""

    brake_gain: Annotated[Scalar, require_quantity("N m MPa-1", above=0)]
    stiffness: Ratio
    damping_ratio: Ratio


class EventsEntry(CatalogueEntry):
    """How it brakes; the meanings are given by ``DriveStyle``."""

    start_speed: Annotated[Table, require_quantity("km h-1", above=0)]
    peak_pressure: Annotated[Table, require_quantity("bar", above=0)]
    ramp: Seconds
    hold: Seconds
    release: Seconds
    curve_share: Share
    rough_share: Share
    dragging_share: Share
    lift_share: Share
    slope: Annotated[Scalar, require_quantity("deg", minimum=0)]

    @field_validator("start_speed", "peak_pressure", "ramp", "hold", "release")
    @classmethod
    def _is_a_range(cls, table: Table) -> Table:
        if len(table.value) != 2 or table.value[0] > table.value[1]:
            raise ValueError(f"must be the smallest and the largest value; it is {list(table.value)}")
        return table


class SignalEntry(CatalogueEntry):
    """One signal; the meanings are given by ``BusSignal``."""

    name: Text
    channel: Text
    unit: Text
    rate_hz: Positive
    resolution: Positive
    noise: Annotated[float, Field(strict=True, ge=0)]

    @field_validator("channel")
    @classmethod
    def _is_known(cls, channel: str) -> str:
        if channel not in CHANNELS_BY_NAME:
            raise ValueError(f"no such channel; there are: {', '.join(CHANNELS_BY_NAME)}; it is {channel}")
        return channel

    @model_validator(mode="after")
    def _unit_is_of_the_channel(self) -> "SignalEntry":
        unit_factor(self.unit, CHANNELS_BY_NAME[self.channel].unit)
        return self


class BusEntry(CatalogueEntry):
    """Content of a bus file."""

    truth: TruthEntry
    events: EventsEntry
    signals: Annotated[tuple[SignalEntry, ...], Field(min_length=1)]

    def build(self) -> Bus:
        """The bus itself."""
        events = self.events

        def pair(table: Table, factor: float = 1.0) -> tuple[float, float]:
            return table.value[0] * factor, table.value[1] * factor

        return Bus(
            truth=DiveModel(
                # the rollout makes its own pitch moment, so the car has no such gain
                pitch_gain=1.0,
                **{name: getattr(self.truth, name).value for name in TruthEntry.model_fields},
            ),
            style=DriveStyle(
                start_speed=pair(events.start_speed, unit_factor("km/h", "m/s")),
                peak_pressure=pair(events.peak_pressure, unit_factor("bar", "MPa")),
                ramp=pair(events.ramp),
                hold=pair(events.hold),
                release=pair(events.release),
                curve_share=events.curve_share.value,
                rough_share=events.rough_share.value,
                dragging_share=events.dragging_share.value,
                lift_share=events.lift_share.value,
                slope=events.slope.value,
            ),
            signals=tuple(BusSignal(**signal.model_dump()) for signal in self.signals),
        )
