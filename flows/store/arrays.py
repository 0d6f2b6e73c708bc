"""The arrays of ``frames.zarr``: their type, further dimensions and meaning."""

ARRAYS: dict[str, tuple[str, tuple[str, ...], str]] = {
    "rgb": ("uint8", ("channel",), "sRGB-encoded colour"),
    "depth": ("float32", (), "camera z [m], rounded to 13 mantissa bits; NaN where nothing is seen"),
    "class": ("uint8", (), "semantic class"),
}
LABEL_ARRAYS: dict[str, tuple[str, tuple[str, ...], str]] = {
    "normal": ("int8", ("axis",), "world normal in steps of 1/127; zero where nothing is seen"),
    "road": ("float32", ("coordinate",), "station and lateral position of road pixels [m]; NaN off the road"),
    "flow": ("float32", ("direction",), "way right and down to the next frame [px]; NaN without depth"),
    "marks": (
        "uint8",
        (),
        "bits: what changed the pixel, what is out of sight in the next frame, what is hazard",
    ),
}
"""Written where the grid asks for labels."""
DIMENSION_SIZES = {"channel": 3, "axis": 3, "coordinate": 2, "direction": 2}


def arrays_of(labels: bool) -> dict[str, tuple[str, tuple[str, ...], str]]:
    """Type, further dimensions and meaning of the arrays of a dataset with or without labels."""
    return ARRAYS | LABEL_ARRAYS if labels else ARRAYS
