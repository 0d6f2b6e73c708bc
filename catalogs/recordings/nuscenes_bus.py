"""CAN bus messages of nuScenes: a list of one kind of message of one scene, ``scene-0001_vehicle_monitor.json``.

Each message has a ``utime`` [us]; its other numbers are signals, those of a list by their index: ``accel[0]``. The
files of a scene in a folder are one recording; a name that several kinds of message have is given as ``KIND.NAME``.

Format: python-sdk/nuscenes/can_bus/README.md of nuscenes-devkit
"""

import re
from pathlib import Path
from typing import Any

import numpy as np

from catalogs.channel_maps import ChannelMap
from catalogs.documents import parse_json, read_content
from catalogs.recordings.forms import (
    LARGEST_FILE,
    MOST_COLUMNS,
    MOST_NAMES,
    Form,
    SignalSummary,
    describe_missing,
    describe_twice,
    signal_names,
    summarise_signal,
)
from tasks.campaign.signals import Signal
from tasks.errors import InputError

_FILE = re.compile(r"(scene-\d+)_(\w+)\.json")
UNITS = {
    "vehicle_speed": "km/h", "odom_speed": "km/h", "accel": "m/s^2", "linear_accel": "m/s^2", "vel": "m/s",
    "rotation_rate": "rad/s", "longitudinal_accel": "m/s^2", "transversal_accel": "m/s^2",
    **dict.fromkeys(("FL_wheel_speed", "FR_wheel_speed", "RL_wheel_speed", "RR_wheel_speed"), "rpm"),
    **dict.fromkeys(("rear_left_rpm", "rear_right_rpm"), "rpm"),
}  # fmt: skip
"""Units that the format's description gives, by name."""


def find_scene(file: Path) -> Path | None:
    """Return the recording to which a file of messages belongs in a folder: its scene, which is no file itself."""
    match = _FILE.fullmatch(file.name)
    return file.with_name(match.group(1)) if match else None


def list_scene_files(scene: Path) -> tuple[Path, ...]:
    """Return the files of a scene's messages; none where it is another thing."""
    if scene.exists() or not scene.parent.is_dir():
        return ()
    return tuple(file for file in sorted(scene.parent.glob("*.json")) if find_scene(file) == scene)


def read_scene(path: Path, channel_map: ChannelMap) -> dict[str, Signal]:
    """Return the signals of a file of messages, or of a scene, that a map names.

    Raises
    ------
    InputError
        With one sentence per problem.
    """
    signals = _load_signals(path)
    problems, found = [], {}
    for name in signal_names(channel_map):
        kinds = [known for known in signals if known == name or known.endswith(f".{name}")]
        if len(kinds) == 1:
            found[name] = signals[kinds[0]]
        elif kinds:
            problems.append(describe_twice(path, name, dict.fromkeys(kinds, "")))
        else:
            problems += describe_missing(path, (name,), (), signals)
    if problems:
        raise InputError(problems)
    return found


def summarise_scene(path: Path, _: ChannelMap | None) -> list[SignalSummary]:
    """Return a row for each number of the messages.

    Raises
    ------
    InputError
        If a file cannot be read.
    """
    return [summarise_signal(name, signal) for name, signal in _load_signals(path).items()]


def _load_signals(path: Path) -> dict[str, Signal]:
    """Return the numbers of all messages, by ``KIND.NAME`` in a scene and by name in a file."""
    signals: dict[str, Signal] = {}
    for file in list_scene_files(path) or (path,):
        kind = "" if file == path else f"{_FILE.fullmatch(file.name).group(2)}."  # type: ignore[union-attr]
        content = parse_json(
            read_content(file, "recording", LARGEST_FILE), file, "recording", large_integers=True
        )
        if is_list_of_messages(content):
            signals |= {f"{kind}{name}": signal for name, signal in collect_signals(file, content).items()}
        elif file == path:
            raise InputError(f"{path}: must be a list of messages, each with its utime")
    return signals


def is_list_of_messages(content: Any) -> bool:
    """Return whether a document is a list of tables of which each has a ``utime``."""
    return (
        isinstance(content, list)
        and bool(content)
        and all(isinstance(entry, dict) and _is_number(entry.get("utime")) for entry in content)
    )


def collect_signals(path: Path, messages: list[dict[str, Any]]) -> dict[str, Signal]:
    """Return the numbers of messages by name, each on the clock of the messages that hold it.

    Raises
    ------
    InputError
        If there are more names than a recording has.
    """
    columns: dict[str, tuple[list[float], list[float]]] = {}
    for message in messages:
        time = message["utime"] * 1e-6
        for key, value in message.items():
            listed = isinstance(value, list) and len(value) <= MOST_COLUMNS
            numbers = {f"{key}[{k}]": x for k, x in enumerate(value)} if listed else {key: value}
            for name, number in numbers.items():
                if key != "utime" and _is_number(number):
                    times, values = columns.setdefault(name, ([], []))
                    times.append(time)
                    values.append(float(number))
        if len(columns) > MOST_NAMES:
            raise InputError(f"{path.name}: must have at most {MOST_NAMES} signals; it has more")
    return {
        name: Signal(
            time=np.array(times), values=np.array(values), unit=UNITS.get(name.partition("[")[0], "")
        )
        for name, (times, values) in columns.items()
    }


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float)


SCENE = Form(read=read_scene, summarise=summarise_scene)
