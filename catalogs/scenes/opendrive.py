"""OpenDRIVE: the road of a street, for traffic and vehicle simulation tools.

It lies in the world frame of the street's Gaussians and poses. The reference line is the route, the middle
of the right lane; ``laneOffset`` puts the centre line half a lane to its left. Plan view: pieces of 5 m at most, each a
line, an arc or a spiral from its own start, so that errors do not add up; elevation: a cubic a piece. Lanes: driving,
shoulder or parking, and sidewalk. OpenDRIVE counts s in plan, muSync its stations along the road.

Format: ASAM OpenDRIVE 1.7.0, https://www.asam.net/standards/detail/opendrive
"""

from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from catalogs.scenes import find_recipe
from catalogs.scenes.street import STREET_FILE, load_street_layout
from tasks.errors import InputError
from tasks.scene.street.bend import integrate_course
from tasks.scene.street.layout import StreetLayout

ROAD_ID = "1"
PIECE = 5.0
"""Longest piece of the plan view [m]."""
STRAIGHT = 1e-9
"""Curvature below which a piece is a line, and difference below which it is an arc [1/m]."""


def find_street(name: str) -> StreetLayout:
    """Return the layout of a street that muSync makes.

    Parameters
    ----------
    name : of the scene

    Raises
    ------
    InputError
        If a scene is no such street: of a cloud, no lanes are known.
    """
    recipe = find_recipe(name)
    if recipe is None:
        raise InputError(f"scene {name} is no street that muSync makes: its lanes are unknown")
    changes, seed = recipe
    return load_street_layout(STREET_FILE, *changes, seed=seed)


def format_opendrive(layout: StreetLayout, name: str) -> str:
    """Return the road of a street as the text of an OpenDRIVE file.

    Parameters
    ----------
    layout : of the street
    name : of the road
    """
    station, s = _place_pieces(layout)
    root = ET.Element("OpenDRIVE")
    ET.SubElement(root, "header", revMajor="1", revMinor="7", name=name, version="1.00", vendor="muSync")
    road = ET.SubElement(
        root, "road", name=name, length=_number(s[-1]), id=ROAD_ID, junction="-1", rule="RHT"
    )
    is_town = "town" if layout.has_pavement else "rural"
    ET.SubElement(road, "type", s="0", type=is_town)
    _add_plan_view(road, layout, station, s)
    _add_elevation(road, layout, station, s)
    ET.SubElement(road, "lateralProfile")
    lanes = ET.SubElement(road, "lanes")
    ET.SubElement(lanes, "laneOffset", s="0", a=_number(layout.lane_width / 2), b="0", c="0", d="0")
    section = ET.SubElement(lanes, "laneSection", s="0")
    kinds = [
        ("driving", layout.lane_width),
        ("parking" if layout.parked_share else "shoulder", layout.parking_width),
    ]
    kinds += [("sidewalk", layout.kerb_width + layout.pavement_width)]
    kinds = [(kind, width) for kind, width in kinds if width > 0]
    left = ET.SubElement(section, "left")
    for number in range(len(kinds), 0, -1):
        _add_lane(left, layout, number, *kinds[number - 1])
    centre = ET.SubElement(ET.SubElement(section, "center"), "lane", id="0", type="none", level="false")
    _add_mark(centre, "broken", layout.marking_width)
    right = ET.SubElement(section, "right")
    for number, (kind, width) in enumerate(kinds, start=1):
        _add_lane(right, layout, -number, kind, width)
    if layout.has_crossing:
        _add_crossing(road, layout, station, s)
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def locate_station(layout: StreetLayout, station: float) -> float:
    """Return s of the file at a station of the route, on along the ends beyond them [m].

    Parameters
    ----------
    layout : of the street
    station : [m]
    """
    places, s = _place_pieces(layout)
    beyond = station - float(np.clip(station, places[0], places[-1]))
    return float(np.interp(station, places, s)) + beyond


def _place_pieces(layout: StreetLayout) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the stations at which pieces begin, and the last one's end [m], and s in plan there [m]."""
    first, last = layout.station_range
    even = np.linspace(first, last, int(np.ceil((last - first) / PIECE)) + 1)
    knots = layout.course.knots
    station = np.unique(np.concatenate([even, knots[(knots > first) & (knots < last)]]))
    station = station[np.concatenate([[True], np.diff(station) > 1e-3])]
    line = integrate_course(layout)
    flat = np.sqrt(1 - line.grade**2)
    way = np.concatenate([[0.0], np.cumsum((flat[1:] + flat[:-1]) / 2 * np.diff(line.station))])
    return station, np.interp(station, line.station, way) - np.interp(first, line.station, way)


def _add_plan_view(
    road: ET.Element, layout: StreetLayout, station: NDArray[np.float64], s: NDArray[np.float64]
) -> None:
    line = integrate_course(layout)
    curvature = layout.course.curvature_at(station) / np.sqrt(1 - layout.course.grade_at(station) ** 2)
    kept = _drop_even(curvature)
    station, s, curvature = station[kept], s[kept], curvature[kept]
    points = line.to_world(np.column_stack([station, np.zeros((len(station), 2))]))
    heading = line.heading_at(station)
    view = ET.SubElement(road, "planView")
    for k in range(len(station) - 1):
        piece = ET.SubElement(
            view, "geometry", s=_number(s[k]), x=_number(points[k, 0]), y=_number(points[k, 1]),
            hdg=_number(heading[k]), length=_number(s[k + 1] - s[k]),
        )  # fmt: skip
        begin, end = curvature[k], curvature[k + 1]
        if abs(end - begin) > STRAIGHT:
            ET.SubElement(piece, "spiral", curvStart=_number(begin), curvEnd=_number(end))
        elif abs(begin) > STRAIGHT:
            ET.SubElement(piece, "arc", curvature=_number(begin))
        else:
            ET.SubElement(piece, "line")


def _add_elevation(
    road: ET.Element, layout: StreetLayout, station: NDArray[np.float64], s: NDArray[np.float64]
) -> None:
    line = integrate_course(layout)
    if layout.course.bloss_share == 0:  # a cubic is then a whole vertical curve
        whole = np.isin(station, layout.course.knots) | np.isin(station, layout.station_range)
        station, s = station[whole], s[whole]
    grade = layout.course.grade_at(station)
    kept = _drop_even(grade)
    station, s, grade = station[kept], s[kept], grade[kept]
    z = np.interp(station, line.station, line.z)
    slope = grade / np.sqrt(1 - grade**2)
    profile = ET.SubElement(road, "elevationProfile")
    for k in range(len(station) - 1):
        h, rise = s[k + 1] - s[k], z[k + 1] - z[k]
        c = (3 * rise / h - 2 * slope[k] - slope[k + 1]) / h
        d = (slope[k] + slope[k + 1] - 2 * rise / h) / h**2
        ET.SubElement(
            profile,
            "elevation",
            s=_number(s[k]),
            a=_number(z[k]),
            b=_number(slope[k]),
            c=_number(c),
            d=_number(d),
        )


def _drop_even(value: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which points to keep: not those with the value of the points before and after them."""
    even = np.abs(np.diff(value)) < STRAIGHT
    return ~np.concatenate([[False], even[1:] & even[:-1], [False]])


def _add_lane(side: ET.Element, layout: StreetLayout, number: int, kind: str, width: float) -> None:
    lane = ET.SubElement(side, "lane", id=str(number), type=kind, level="false")
    ET.SubElement(lane, "width", sOffset="0", a=_number(width), b="0", c="0", d="0")
    _add_mark(lane, "solid" if kind == "driving" else "none", layout.marking_width)
    if kind == "sidewalk":
        ET.SubElement(
            lane, "height", sOffset="0", inner=_number(layout.kerb_height), outer=_number(layout.kerb_height)
        )


def _add_mark(lane: ET.Element, kind: str, width: float) -> None:
    ET.SubElement(
        lane, "roadMark", sOffset="0", type=kind, material="standard", color="white", width=_number(width),
        laneChange="none",
    )  # fmt: skip


def _add_crossing(
    road: ET.Element, layout: StreetLayout, station: NDArray[np.float64], s: NDArray[np.float64]
) -> None:
    begin, end = layout.crossing_station, layout.crossing_station + layout.crossing_length
    objects = ET.SubElement(road, "objects")
    middle = (layout.carriageway_left + layout.carriageway_right) / 2
    along = float(np.interp((begin + end) / 2, station, s))
    ET.SubElement(
        objects, "object", type="crosswalk", id="1", name="crossing", s=_number(along),
        t=_number(middle), zOffset="0", orientation="none", length=_number(layout.crossing_length),
        width=_number(layout.carriageway_left - layout.carriageway_right), height="0", hdg="0", pitch="0", roll="0",
    )  # fmt: skip


def _number(value: float) -> str:
    return f"{value:.12g}"
