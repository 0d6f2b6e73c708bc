"""The arrays of ``frames.zarr``: their type, further dimensions, unit and meaning."""

from dataclasses import dataclass

from tasks.conventions import Channel, SemanticClass


@dataclass(frozen=True, kw_only=True)
class PixelArray:
    """One array ``[clip, frame, y, x, *dimensions]``.

    Parameters
    ----------
    channel : its name, unit and meaning, as of a telemetry column
    dtype : of its numbers
    dimensions : further ones
    flags : meanings of its values, in order from 0; none where values are no codes
    """

    channel: Channel
    dtype: str
    dimensions: tuple[str, ...] = ()
    flags: tuple[str, ...] = ()


def _define_array(
    name: str,
    dtype: str,
    unit: str,
    description: str,
    dimensions: tuple[str, ...] = (),
    flags: tuple[str, ...] = (),
) -> PixelArray:
    channel = Channel(name=name, unit=unit, symbol="", description=description)
    return PixelArray(channel=channel, dtype=dtype, dimensions=dimensions, flags=flags)


_CLASSES = tuple(kind.name.lower() for kind in SemanticClass)
_PIXELS = (
    _define_array("rgb", "uint8", "1", "sRGB-encoded colour", ("channel",)),
    _define_array(
        "depth", "float32", "m", "camera z, rounded to 13 mantissa bits; NaN where nothing is seen"
    ),
    _define_array("class", "uint8", "1", "semantic class", flags=_CLASSES),
)
_LABELS = (
    _define_array(
        "normal", "int8", "1", "world normal in steps of 1/127; zero where nothing is seen", ("axis",)
    ),
    _define_array(
        "road",
        "float32",
        "m",
        "station and lateral position of road pixels; NaN off the road",
        ("coordinate",),
    ),
    _define_array(
        "flow", "float32", "px", "way right and down to the next frame; NaN without depth", ("direction",)
    ),
    _define_array(
        "marks", "uint8", "1", "bits: what changed the pixel, is out of sight in the next frame, is hazard"
    ),
)
_INSTANCES = (
    _define_array(
        "instance",
        "uint16",
        "1",
        "number of the road user that the pixel shows, of the table of objects; 0 for none",
    ),
)
ARRAYS = {array.channel.name: array for array in _PIXELS}
LABEL_ARRAYS = {array.channel.name: array for array in _LABELS}
"""Written where the grid asks for labels."""
DIMENSION_SIZES = {"channel": 3, "axis": 3, "coordinate": 2, "direction": 2}


INSTANCE_ARRAYS = {array.channel.name: array for array in _INSTANCES}
"""Written where the grid has road users."""
EVERY_ARRAY = ARRAYS | INSTANCE_ARRAYS | LABEL_ARRAYS


def arrays_of(labels: bool, objects: bool) -> dict[str, PixelArray]:
    """The arrays of a dataset with or without labels, and with or without road users, by name."""
    return ARRAYS | (INSTANCE_ARRAYS if objects else {}) | (LABEL_ARRAYS if labels else {})
