"""OpenSCENARIO: a scenario's ego vehicle and road users on a road, for other simulators, and such files as scenarios.

Format: ASAM OpenSCENARIO 1.2, https://www.asam.net/standards/detail/openscenario-xml. Weather and brake are no part of
it: a file says who is where, how fast, and what changes its speed at which time.
"""

from math import cos, degrees, inf, pi
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from pydantic import ValidationError

from catalogs.entries import load
from catalogs.road_users import EGO, Kind, RoadUser
from catalogs.scenario import Scenario
from catalogs.scenes.opendrive import ROAD_ID, locate_station
from catalogs.sentences import describe_rules, shorten
from tasks.errors import InputError
from tasks.scene.street.layout import StreetLayout

PEDESTRIANS: dict[Kind, float] = {"adult": 75.0, "child": 30.0}
"""Kinds that are pedestrians there, with the mass that the format wants [kg]."""
CATEGORIES = {"car": "car", "van": "van", "truck": "truck", "bicycle": "bicycle"}
LONGEST_BYTES = 2**20
REFUSED = ("ParameterDeclaration", "CatalogReference", "GlobalAction", "LateralAction")
"""Elements of a file that mean more than is read."""
STEP = {"dynamicsShape": "step", "dynamicsDimension": "time", "value": "0"}


def format_openscenario(
    scenario: Scenario, layout: StreetLayout, *, name: str, road_file: str, wheelbase: float
) -> str:
    """Return a scenario as the text of an OpenSCENARIO file.

    Parameters
    ----------
    scenario : speed of the ego vehicle, which nobody brakes, and road users on tracks by stations
    layout : of the street
    name : of the scenario
    road_file : OpenDRIVE file of the street, as the scenario names it
    wheelbase : of the ego vehicle [m]

    Raises
    ------
    InputError
        For a track in the world.
    """
    root = ET.Element("OpenSCENARIO")
    ET.SubElement(
        root, "FileHeader", revMajor="1", revMinor="2", date="2026-01-01T00:00:00", author="muSync", description=name
    )  # fmt: skip
    ET.SubElement(root, "CatalogLocations")
    ET.SubElement(ET.SubElement(root, "RoadNetwork"), "LogicFile", filepath=road_file)
    entities, board = ET.SubElement(root, "Entities"), ET.SubElement(root, "Storyboard")
    actions = ET.SubElement(ET.SubElement(board, "Init"), "Actions")
    sizes = load("road user sizes")
    overhang, width = sizes[EGO]
    _, _, height = sizes["car"]  # no height of the ego is used elsewhere: as tall as the car target
    ego = (wheelbase + 2 * overhang, width, height)
    _add_entity(entities, EGO, "car", ego, wheelbase / 2)
    _add_start(actions, EGO, locate_station(layout, -wheelbase), 0.0, 0.0, scenario.initial_speed_km_h / 3.6)
    for number, user in enumerate(scenario.objects, start=1):
        entity, size = f"{user.kind}-{number}", user.choose_size(sizes)
        track = user.build_track(size)
        if track.in_world:
            raise InputError(f"{name}: {entity} must have a track by station_m or gap_m; it has world_m")
        _add_entity(entities, entity, user.kind, size, 0.0)
        s = locate_station(layout, track.start[0])
        _add_start(actions, entity, s, track.start[1], track.heading, track.speed)
        if track.change_at < inf:
            _add_change(board, entity, track.change_at, abs(track.acceleration), track.final_speed)
    ET.SubElement(board, "StopTrigger")
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _add_entity(entities: ET.Element, name: str, kind: Kind, size: tuple[float, ...], middle: float) -> None:
    """Add a body whose box has its middle ahead of the point that positions mean [m]."""
    entity = ET.SubElement(entities, "ScenarioObject", name=name)
    if kind in PEDESTRIANS:
        body = ET.SubElement(
            entity, "Pedestrian", name=kind, mass=_number(PEDESTRIANS[kind]), pedestrianCategory="pedestrian"
        )
    else:
        body = ET.SubElement(entity, "Vehicle", name=kind, vehicleCategory=CATEGORIES[kind])
    box = ET.SubElement(body, "BoundingBox")
    length, width, height = size
    ET.SubElement(box, "Center", x=_number(middle), y="0", z=_number(height / 2))
    ET.SubElement(box, "Dimensions", width=_number(width), length=_number(length), height=_number(height))
    if kind not in PEDESTRIANS:
        ET.SubElement(body, "Performance", maxSpeed="70", maxAcceleration="10", maxDeceleration="10")
        axles, reach = ET.SubElement(body, "Axles"), max(middle, 0.3 * length)
        for axle, steering, x in (("FrontAxle", "0.5", middle + reach), ("RearAxle", "0", middle - reach)):
            ET.SubElement(
                axles, axle, maxSteering=steering, wheelDiameter="0.6", trackWidth=_number(0.85 * width),
                positionX=_number(x), positionZ="0.3",
            )  # fmt: skip
    ET.SubElement(body, "Properties")


def _add_start(actions: ET.Element, name: str, s: float, t: float, heading: float, speed: float) -> None:
    private = ET.SubElement(actions, "Private", entityRef=name)
    teleport = ET.SubElement(ET.SubElement(private, "PrivateAction"), "TeleportAction")
    place = ET.SubElement(
        ET.SubElement(teleport, "Position"), "RoadPosition", roadId=ROAD_ID, s=_number(s), t=_number(t)
    )
    ET.SubElement(place, "Orientation", type="relative", h=_number(heading))
    _add_speed(ET.SubElement(private, "PrivateAction"), speed, STEP)


def _add_change(board: ET.Element, name: str, at: float, rate: float, speed: float) -> None:
    """Add a change of speed at a rate [m/s2] that begins at a time [s]."""
    act = ET.SubElement(ET.SubElement(board, "Story", name=name), "Act", name=f"{name} drives")
    group = ET.SubElement(act, "ManeuverGroup", name=f"{name} alone", maximumExecutionCount="1")
    ET.SubElement(
        ET.SubElement(group, "Actors", selectTriggeringEntities="false"), "EntityRef", entityRef=name
    )
    manoeuvre = ET.SubElement(group, "Maneuver", name=f"{name} changes speed")
    event = ET.SubElement(manoeuvre, "Event", name="change of speed", priority="override")
    action = ET.SubElement(ET.SubElement(event, "Action", name="speed"), "PrivateAction")
    _add_speed(
        action, speed, {"dynamicsShape": "linear", "dynamicsDimension": "rate", "value": _number(rate)}
    )
    _add_time(event, at)
    _add_time(act, 0.0)


def _add_speed(action: ET.Element, speed: float, dynamics: dict[str, str]) -> None:
    change = ET.SubElement(ET.SubElement(action, "LongitudinalAction"), "SpeedAction")
    ET.SubElement(change, "SpeedActionDynamics", dynamics)
    ET.SubElement(ET.SubElement(change, "SpeedActionTarget"), "AbsoluteTargetSpeed", value=_number(speed))


def _add_time(parent: ET.Element, at: float) -> None:
    group = ET.SubElement(ET.SubElement(parent, "StartTrigger"), "ConditionGroup")
    condition = ET.SubElement(group, "Condition", name=f"at {at:g} s", delay="0", conditionEdge="none")
    ET.SubElement(
        ET.SubElement(condition, "ByValueCondition"), "SimulationTimeCondition", value=_number(at),
        rule="greaterOrEqual",
    )  # fmt: skip


def _number(value: float) -> str:
    return f"{value:.12g}"


def read_openscenario(path: Path) -> Scenario:
    """Return the scenario of an OpenSCENARIO 1.x file: an entity ``ego``, and road users on straight tracks.

    Every entity begins by a RoadPosition on one level road, at a speed. Of a road user at most one SpeedAction changes
    it, at a rate or over a time, from a simulation time on; its kind is that of its category with the most similar box.
    What else a file has is refused, so that nobody drives another scenario than it says.

    Parameters
    ----------
    path : of the file

    Raises
    ------
    InputError
        If it is no such file, or has another shape.
    """
    try:
        content = path.read_bytes()
        if len(content) > LONGEST_BYTES or b"<!DOCTYPE" in content:
            raise InputError(
                f"{path}: must be at most {LONGEST_BYTES} bytes long and declare no document type"
            )
        root = ET.fromstring(content)  # noqa: S314 (without a document type it has no entities that grow)
        return _read_scenario(root)
    except (OSError, ET.ParseError, _Shape) as error:
        raise InputError(f"{path}: cannot be read as an OpenSCENARIO file: {shorten(error)}") from None
    except ValidationError as error:
        raise InputError(describe_rules(error, str(path))) from None
    except (ValueError, TypeError) as error:
        raise InputError(f"{path}: has something else where a number belongs: {shorten(error)}") from None


class _Shape(Exception):
    """A file has another shape than is read."""


def _read_scenario(root: ET.Element) -> Scenario:
    if root.tag != "OpenSCENARIO":
        raise _Shape(f"its root is {root.tag}")
    if found := [tag for tag in REFUSED if next(root.iter(tag), None) is not None]:
        raise _Shape(f"it has {', '.join(found)}")
    bodies = {one.get("name"): one for one in root.iter("ScenarioObject")}
    starts = {one.get("entityRef"): one for one in root.iterfind("Storyboard/Init/Actions/Private")}
    if EGO not in bodies or bodies.keys() != starts.keys():
        raise _Shape(
            f"it needs an entity {EGO}, and a start of every entity; it has {', '.join(map(str, bodies))}"
        )
    changes = [_read_change(act) for act in root.iter("Act")]
    if len({name for name, _ in changes}) < len(changes) or any(name in (EGO, None) for name, _ in changes):
        raise _Shape("each road user may change its speed once, and nobody else may")
    road, front, lateral, heading, speed, size = _read_start(bodies[EGO], starts[EGO])
    if heading:
        raise _Shape(f"{EGO} must begin along the road")
    # stations count from the front axle of the ego vehicle
    overhang, _ = load("road user sizes")[EGO]
    first = front + size[0] / 2 - overhang
    users = []
    for name, body in bodies.items():
        if name == EGO:
            continue
        where, s, t, turned, pace, box = _read_start(body, starts[name])
        if where != road:
            raise _Shape(f"{name} must begin on the road {road}")
        track: dict[str, Any] = {
            "station_m": s - first, "lateral_m": t - lateral, "heading_deg": degrees(turned), "speed_km_h": pace * 3.6
        }  # fmt: skip
        users.append(_make_user(body, box, track, dict(changes).get(name), pace))
    return Scenario(initial_speed_km_h=speed * 3.6, hold_speed=True, objects=tuple(users))


def _make_user(
    body: ET.Element, size: list[float], track: dict[str, Any], change: tuple[float, float, float, str] | None,
    pace: float,
) -> RoadUser:  # fmt: skip
    """Return a road user, of the kind whose box is most like its own."""
    if change is not None:
        at, speed, value, dimension = change
        rate = value if dimension == "rate" else abs(speed - pace) / value
        track |= {
            "change_at_s": at, "acceleration_m_s2": rate if speed > pace else -rate, "until_km_h": speed * 3.6
        }  # fmt: skip
    told = body[0].get("vehicleCategory")
    sizes = load("road user sizes")
    kinds = [kind for kind, category in CATEGORIES.items() if category == told] or [*PEDESTRIANS]
    kind = min(kinds, key=lambda one: sum(abs(a - b) for a, b in zip(sizes[one], size, strict=True)))
    return RoadUser.model_validate({"kind": kind, "track": track})


def _read_start(body: ET.Element, private: ET.Element) -> tuple[str, float, float, float, float, list[float]]:
    """Return road, s and t of the middle of the box [m], heading [rad], speed [m/s] and size [m]."""
    place, target = private.find(".//RoadPosition"), private.find(".//SpeedAction")
    center, box = body.find(".//BoundingBox/Center"), body.find(".//BoundingBox/Dimensions")
    if place is None or target is None or center is None or box is None:
        raise _Shape(
            f"{body.get('name')} needs a BoundingBox, a RoadPosition and a SpeedAction to begin with"
        )
    turn = place.find("Orientation")
    heading = 0.0 if turn is None else float(turn.get("h", "0"))
    if turn is not None and turn.get("type") != "relative" and heading:
        raise _Shape(f"the orientation of {body.get('name')} must be relative to the road")
    if abs(heading) > 2 * pi:
        raise _Shape(f"the heading of {body.get('name')} must be in radians")
    x, y = float(center.get("x", "nan")), float(center.get("y", "nan"))
    if y:
        raise _Shape(f"the box of {body.get('name')} must be in its middle")
    s, t = (float(place.get(name, "nan")) for name in ("s", "t"))
    size = [float(box.get(name, "nan")) for name in ("length", "width", "height")]
    middle = s + x * cos(heading), t + x * cos(heading - pi / 2)
    return place.get("roadId", ""), *middle, heading, _read_speed(target)[0], size


def _read_change(act: ET.Element) -> tuple[str | None, tuple[float, float, float, str]]:
    """Return of which entity an act changes the speed, from when [s], to which [m/s], and how."""
    actor, action, trigger = (
        act.find(".//EntityRef"),
        act.find(".//SpeedAction"),
        act.find(".//Event/StartTrigger"),
    )
    times = [] if trigger is None else list(trigger.iter("Condition"))
    at = times[0].find(".//SimulationTimeCondition") if len(times) == 1 else None
    if actor is None or action is None or at is None or len(list(act.iter("Action"))) != 1:
        raise _Shape(f"act {act.get('name')} must be one SpeedAction of one entity from a simulation time on")
    speed, value, dimension = _read_speed(action)
    if dimension not in ("rate", "time"):
        raise _Shape(
            f"act {act.get('name')} must change the speed at a rate or over a time; it has {dimension}"
        )
    return actor.get("entityRef"), (float(at.get("value", "nan")), speed, value, dimension)


def _read_speed(action: ET.Element) -> tuple[float, float, str]:
    """Return the speed of an action [m/s], and the value and the dimension of its dynamics."""
    target, how = action.find(".//AbsoluteTargetSpeed"), action.find("SpeedActionDynamics")
    if target is None or how is None:
        raise _Shape("every speed must be an absolute one")
    return float(target.get("value", "nan")), float(how.get("value", "nan")), how.get("dynamicsDimension", "")
