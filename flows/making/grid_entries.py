"""The catalogue files that a grid uses: which these are, where they lie, and what they hold."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from catalogs.entries import open_entry
from catalogs.grids import GridFile
from catalogs.grids.form import BEFORE
from catalogs.low_speed import LOW_SPEED, LOW_SPEED_CUT
from catalogs.road_users import BODIES, ROAD_USERS
from catalogs.scenes.gaussian_files import read_gaussians
from catalogs.studies.ablation import ABLATION
from catalogs.vehicles import open_vehicle
from catalogs.weather.grip import WEATHER
from catalogs.wet_friction import WET_FRICTION
from tasks.errors import InputError
from tasks.render.camera import Camera
from tasks.surface.state import SurfaceParameters
from tasks.surface.weather import WEATHERS
from tasks.vehicle.paper.low_speed import SteadyStop
from tasks.vehicle.parameters import Vehicle


@dataclass(frozen=True, kw_only=True)
class Input:
    """A catalogue file that datasets keep.

    Parameters
    ----------
    name : under ``inputs/``
    kind : of the entry
    setting : of a grid, which names the entry; None for the only entry of its kind
    needed : whether the datasets of a grid keep it
    """

    name: str
    kind: str
    setting: str | None = None
    needed: Callable[[GridFile], bool] = lambda settings: True


INPUTS = (
    Input(name="vehicle.yaml", kind="vehicle", setting="vehicle"),
    Input(name="surface.yaml", kind="surface", setting="surface"),
    Input(name="camera.yaml", kind="camera", setting="camera"),
    Input(name="gates.yaml", kind="gate file"),
    Input(name="study.yaml", kind="sensitivity study"),
    Input(
        name="hazard_marking.yaml", kind="hazard marking", setting="hazard_marking",
        needed=lambda settings: settings.marked_features,
    ),
    Input(name=ROAD_USERS, kind="road user sizes", needed=lambda settings: settings.has_objects),
    Input(name=LOW_SPEED, kind="low-speed rule", needed=lambda settings: settings.keeps_stops_steady),
    Input(name=WET_FRICTION, kind="wet friction", needed=lambda settings: settings.grips_by_speed),
    Input(name=ABLATION, kind="ablation", needed=lambda settings: settings.variant == "fixed-mu"),
    Input(
        name=LOW_SPEED_CUT, kind="cut of the low-speed rule",
        needed=lambda settings: settings.variant == "no-low-speed-rule",
    ),
)  # fmt: skip
"""The files but for those of the weather, of the scene, and of the tyre that a vehicle names."""
OWN_ENTRIES = tuple(row.setting for row in INPUTS if row.setting is not None)
"""Settings that name a catalogue entry, which may be a file of the user's."""


@dataclass(frozen=True, kw_only=True)
class GridEntries:
    """The catalogue entries of a grid, each file read once.

    Parameters
    ----------
    contents : name under ``inputs/`` to what a dataset keeps
    values : name under ``inputs/`` to what a sound file holds
    files : name under ``inputs/`` to the setting that names a file, or names a vehicle that does, and the file
    problems : one sentence each
    """

    contents: dict[str, bytes]
    values: Mapping[str, Any]
    files: Mapping[str, tuple[str, Path]]
    problems: list[str]

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle; `KeyError` where it is faulty, as of the other entries."""
        return self.values["vehicle.yaml"]

    @property
    def surface(self) -> SurfaceParameters:
        """The pavement."""
        pavement, wet = self.values["surface.yaml"], self.values.get(WET_FRICTION)
        return pavement if wet is None else wet.apply(pavement)

    @property
    def camera(self) -> Camera:
        """The camera."""
        return self.values["camera.yaml"]

    @property
    def steady(self) -> SteadyStop | None:
        """How stops end; None where the published rule is taken literally."""
        steady: SteadyStop | None = self.values.get(LOW_SPEED)
        return steady and replace(steady, pitch_rule=self.values.get(LOW_SPEED_CUT, True))


def read_entries(settings: GridFile, weathers: Collection[str] = ()) -> GridEntries:
    """Read the catalogue files that a grid names, and of the weather the air, the sky and the kinds that it has.

    Parameters
    ----------
    settings : of the grid
    weathers : kinds of weather of its scenarios
    """
    contents: dict[str, bytes] = {}
    values: dict[str, Any] = {}
    files: dict[str, tuple[str, Path]] = {}
    problems: list[str] = []
    tyre: tuple[Path, bytes] | None = None
    for row in INPUTS:
        if not row.needed(settings):
            continue
        reference: Any = None if row.setting is None else getattr(settings, row.setting)
        try:
            if row.kind == "vehicle":
                file = open_vehicle(reference)
                content, path, value, tyre = file.content, file.source, file.build(), file.tyre
            else:
                content, path, value = open_entry(row.kind, reference)
        except InputError as error:
            problems += error.problems
            continue
        contents[row.name], values[row.name] = content, value
        if row.setting is not None:
            files[row.name] = row.setting, path
    families = {WEATHERS[kind].tyre_family for kind in weathers if kind in WEATHERS}
    unasked = WEATHERS.keys() - families - set(weathers)
    contents |= {
        f"weather/{name}.yaml": content for name, content in WEATHER.contents.items() if name not in unasked
    }
    if tyre is not None:
        path, content = tyre
        contents[path.name], files[path.name] = content, ("vehicle", path)
    for own in dict.fromkeys(user.body for user in settings.road_users if user.body is not None):
        name = f"{BODIES}/{Path(own).name}"
        try:
            read_gaussians(Path(own))
            content = Path(own).read_bytes()
        except InputError as error:
            problems += [f"objects: body {problem}" for problem in error.problems]
            continue
        if contents.setdefault(name, content) != content:
            problems.append(
                f"objects: body {own}: another body has the name {Path(own).name}: rename one of them"
            )
    return GridEntries(contents=contents, values=values, files=files, problems=problems)


def find_private_entries(settings: GridFile) -> list[str]:
    """Return a sentence for each catalogue file whose path is not recorded, so that a record cannot lead to it."""
    return [
        f"{name} must be a name of the catalogue or a path below the working folder, which can be recorded; it is"
        f" {value}: copy the file there and name it so"
        for name in OWN_ENTRIES
        if (value := getattr(settings, name)) is not None and recorded_reference(value) != value
    ]


def recorded_settings(settings: GridFile) -> GridFile:
    """The settings as a dataset records them: the law of wet friction that is driven on, and files by their name alone
    where their path is a private matter.

    Parameters
    ----------
    settings : as asked for
    """
    references = {
        name: recorded_reference(value)
        for name in ("scene", *OWN_ENTRIES)
        if (value := getattr(settings, name)) is not None
    }
    law = {} if settings.grips_by_speed else {"wet_friction": BEFORE["wet_friction"]}
    return settings.model_copy(update=references | law)


def recorded_reference(reference: str) -> str:
    """A catalogue name, or a path below the folder of the run, as it is; of any other path the last part."""
    path = Path(reference)
    return path.name if path.is_absolute() or path.parts[:1] == ("~",) or ".." in path.parts else reference
