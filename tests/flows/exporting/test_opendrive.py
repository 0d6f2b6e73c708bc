"""The road of every kind of street as OpenDRIVE: by its own geometry, and by two foreign readers."""

import subprocess
import sys
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from catalogs.scenes.opendrive import find_street, format_opendrive
from catalogs.street_names import KINDS
from tasks.errors import InputError
from tasks.scene.street.bend import integrate_course, lay_route

STREETS = ("street", "hill", *(f"{kind}-3" for kind in KINDS))


def parse(text: str) -> ET.Element:
    return ET.fromstring(text)  # noqa: S314 (our own text)


def walk(text: str, step: float = 0.05) -> np.ndarray:
    """Points of the reference line by the standard: headings integrate the curvature of each piece from its start."""
    points = []
    for piece in parse(text).iter("geometry"):
        length = float(piece.get("length"))
        s = np.linspace(0, length, int(length / step) + 2)
        kind = piece[0]
        begin = float(kind.get("curvStart", kind.get("curvature", 0)))
        end = float(kind.get("curvEnd", begin))
        heading = float(piece.get("hdg")) + begin * s + (end - begin) * s**2 / (2 * length)
        middle = (heading[1:] + heading[:-1]) / 2
        x = float(piece.get("x")) + np.concatenate([[0], np.cumsum(np.cos(middle) * np.diff(s))])
        y = float(piece.get("y")) + np.concatenate([[0], np.cumsum(np.sin(middle) * np.diff(s))])
        points.append(np.column_stack([float(piece.get("s")) + s, x, y]))
    return np.concatenate(points)


@pytest.mark.parametrize("name", STREETS)
def test_the_reference_line_is_the_route_in_plan_and_height(name):
    layout = find_street(name)
    text = format_opendrive(layout, name)
    route = lay_route(layout, integrate_course(layout)).T_world_rig[:, :3, 3]
    points = walk(text)
    away = np.hypot(points[None, :, 1] - route[:, None, 0], points[None, :, 2] - route[:, None, 1])
    assert away.min(axis=1).max() < 0.03  # between points 0.05 m apart
    s = points[away.argmin(axis=1), 0]
    cubics = [
        {key: float(value) for key, value in row.attrib.items()} for row in parse(text).iter("elevation")
    ]
    starts = np.array([row["s"] for row in cubics])
    for place, height in zip(s, route[:, 2], strict=True):
        row = cubics[np.searchsorted(starts, place, side="right") - 1]
        ds = place - row["s"]
        assert row["a"] + row["b"] * ds + row["c"] * ds**2 + row["d"] * ds**3 == pytest.approx(
            height, abs=0.005
        )


def test_pieces_follow_each_other_without_a_step():
    text = format_opendrive(find_street("country-3"), "country-3")
    pieces = [
        {key: float(value) for key, value in row.attrib.items()} for row in parse(text).iter("geometry")
    ]
    ends = [piece["s"] + piece["length"] for piece in pieces]
    assert ends[:-1] == pytest.approx([piece["s"] for piece in pieces[1:]], abs=1e-6)
    assert ends[-1] == pytest.approx(float(parse(text).find("road").get("length")), abs=1e-6)


def test_lanes_reach_from_kerb_to_kerb():
    layout = find_street("town-3")
    road = parse(format_opendrive(layout, "town-3")).find("road")
    offset = float(road.find("lanes/laneOffset").get("a"))
    widths = {
        side: [float(lane.find("width").get("a")) for lane in road.findall(f"lanes/laneSection/{side}/lane")
               if lane.get("type") != "sidewalk"]
        for side in ("left", "right")
    }  # fmt: skip
    assert offset + sum(widths["left"]) == pytest.approx(layout.carriageway_left)
    assert offset - sum(widths["right"]) == pytest.approx(layout.carriageway_right)


def test_a_cloud_has_no_lanes_to_export(toy_dataset, tmp_path):
    from flows.exporting.export import export_dataset

    with pytest.raises(InputError, match="is no street that muSync makes"):
        export_dataset(str(toy_dataset.root), "opendrive", out=str(tmp_path / "out"))


def test_scenariogeneration_reads_the_road(tmp_path):
    xodr = pytest.importorskip("scenariogeneration.xodr", reason="pip install scenariogeneration")
    layout = find_street("country-3")
    road = parse(format_opendrive(layout, "country-3")).find("road")
    spirals = [piece for piece in road.iter("geometry") if piece[0].tag == "spiral"]
    assert spirals
    for piece in spirals[:4]:
        length, x, y, heading = (float(piece.get(key)) for key in ("length", "x", "y", "hdg"))
        made = xodr.Spiral(float(piece[0].get("curvStart")), float(piece[0].get("curvEnd")), length=length)
        end_x, end_y, end_heading, _ = made.get_end_data(x, y, heading)
        after = next(p for p in road.iter("geometry") if float(p.get("s")) > float(piece.get("s")) + 1e-6)
        assert (end_x, end_y, end_heading) == pytest.approx(
            [float(after.get(key)) for key in ("x", "y", "hdg")], abs=2e-3
        )


def test_asam_s_checker_finds_no_error(tmp_path):
    pytest.importorskip("qc_opendrive", reason="pip install asam-qc-opendrive")
    for name in STREETS:
        file = tmp_path / f"{name}.xodr"
        file.write_text(format_opendrive(find_street(name), name))
        settings = tmp_path / "config.xml"
        settings.write_text(
            f'<?xml version="1.0"?><Config><Param name="InputFile" value="{file}"/>'
            '<CheckerBundle application="xodrBundle">'
            f'<Param name="resultFile" value="{tmp_path / "result.xqar"}"/></CheckerBundle></Config>'
        )
        subprocess.run(
            [sys.executable, "-m", "qc_opendrive.main", "-c", str(settings)], check=True, capture_output=True
        )
        issues = [issue.attrib for issue in parse((tmp_path / "result.xqar").read_text()).iter("Issue")]
        assert [issue for issue in issues if issue.get("level") in ("1", "2")] == [], name
