"""The catalogue entries that a dataset was planned with, from its own frozen copies."""

from dataclasses import replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from catalogs.driven import DrivenClips, read_driven
from catalogs.entries import load
from catalogs.low_speed import LOW_SPEED, LOW_SPEED_CUT
from catalogs.references import read_reference
from catalogs.road_grade import name_grade_file
from catalogs.road_users import BODIES, ROAD_USERS
from catalogs.scenes import load_recipe, load_scene
from catalogs.studies.ablation import ABLATION, FamilyWeather, find_families
from catalogs.vehicles import VehicleFile, open_vehicle
from catalogs.weather.grip import WeatherFolder
from catalogs.weather.look import load_weather
from catalogs.wet_friction import WET_FRICTION
from flows.making.locations import find_scene
from flows.making.plan import read_plan
from flows.making.traced import Reference
from flows.store.layout import Layout
from manifests.manifest import TRACES
from tasks.eval.motion_agreement import PoseThresholds
from tasks.render.camera import Camera
from tasks.render.road_paint import HazardMarking
from tasks.render.weather.parameters import WeatherParameters
from tasks.scene.scene import Scene
from tasks.scene.street.layout import StreetLayout
from tasks.studies.sensitivity import StudyProtocol
from tasks.surface.road_profile import LEVEL_ROAD, RoadGrade
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.paper.low_speed import SteadyStop
from tasks.vehicle.parameters import Vehicle


class Catalogue:
    """The kept entries of a dataset, and its scene: each file is read once, when it is first asked for.

    A property raises `InputError` that lists every problem of its file.

    Parameters
    ----------
    inputs : folder of the kept catalogue files
    scene : name or folder on this machine; empty where none is asked for
    named : what the clips call their scene in a dataset of several; None where it has one
    """

    def __init__(self, inputs: Path, scene: str = "", named: str | None = None) -> None:
        self._inputs, self._scene, self._named = inputs, scene, named

    @cached_property
    def weather(self) -> WeatherFolder:
        """The kinds of weather."""
        return WeatherFolder(self._inputs / "weather")

    @cached_property
    def weather_parameters(self) -> WeatherParameters:
        """How the weathers look."""
        return load_weather(self.weather)

    @cached_property
    def vehicle_file(self) -> VehicleFile:
        """The vehicle as its file has it."""
        return open_vehicle(self._inputs / "vehicle.yaml")

    @cached_property
    def vehicle(self) -> Vehicle:
        """The vehicle."""
        return self.vehicle_file.build(self.weather)

    @cached_property
    def surface(self) -> SurfaceParameters:
        """The pavement."""
        pavement: SurfaceParameters = load("surface", self._inputs / "surface.yaml", self.weather)
        wet = self._load_kept("wet friction", WET_FRICTION)
        return pavement if wet is None else wet.apply(pavement)

    @cached_property
    def camera(self) -> Camera:
        """The camera by the values of its file; that of a clip is of `camera_of`."""
        return load("camera", self._inputs / "camera.yaml")

    def camera_of(self, seed: int) -> Camera:
        """Return the camera of a clip, whose visual seed draws what has bounds."""
        return load("camera", self._inputs / "camera.yaml", seed) if self.camera.varies else self.camera

    @cached_property
    def gates(self) -> PoseThresholds:
        """The limits of the pose check."""
        return load("gate file", self._inputs / "gates.yaml")

    @cached_property
    def study(self) -> StudyProtocol:
        """The study whose bounds give the label ranges."""
        return load("sensitivity study", self._inputs / "study.yaml")[0]

    @cached_property
    def marking(self) -> HazardMarking | None:
        """Paint on road features; None where they are bare."""
        return self._load_kept("hazard marking", "hazard_marking.yaml")

    @cached_property
    def steady(self) -> SteadyStop | None:
        """How stops end; None where the published rule is taken literally."""
        steady: SteadyStop | None = self._load_kept("low-speed rule", LOW_SPEED)
        applied = self._load_kept("cut of the low-speed rule", LOW_SPEED_CUT)
        return steady if steady is None or applied is None else replace(steady, pitch_rule=applied)

    @cached_property
    def families(self) -> FamilyWeather | None:
        """What stands for each kind of weather in ``fixed-mu``; None in any other variant."""
        entry = self._load_kept("ablation", ABLATION)
        return None if entry is None else find_families(entry, self.study)

    @cached_property
    def grade(self) -> RoadGrade:
        """Grade of the scene's road."""
        return self.grade_of(self._named)

    def grade_of(self, scene: str | None) -> RoadGrade:
        """Return the grade of the road in a scene, which is level where none is kept.

        Parameters
        ----------
        scene : as the scenario of a clip calls it
        """
        return self._load_kept("grade of the road", name_grade_file(scene)) or LEVEL_ROAD

    @cached_property
    def road_user_sizes(self) -> dict[str, tuple[float, ...]]:
        """Kind of road user to length, width and height [m]; none where no clip has any."""
        sizes: dict[str, tuple[float, ...]] | None = self._load_kept("road user sizes", ROAD_USERS)
        return sizes or {}

    def own_body(self, name: str) -> Path:
        """Return the kept file of a user's own body, by its path in the grid."""
        return self._inputs / BODIES / Path(name).name

    @cached_property
    def scene(self) -> Scene:
        """The scene."""
        return load_scene(self._scene)

    @cached_property
    def street(self) -> tuple[StreetLayout, int] | None:
        """Layout and seed of a built-in street, whose objects can be drawn finer; None of another scene."""
        return load_recipe(self._scene)

    @cached_property
    def traces(self) -> Reference | None:
        """Reference traces whose motion the clips show; None where the vehicle drives."""
        folder = self._inputs / TRACES
        return read_reference(folder) if folder.is_dir() else None

    @cached_property
    def driven(self) -> DrivenClips | None:
        """Pressures of a policy's drive; None where the scenarios brake."""
        return read_driven(self._inputs)

    def _load_kept(self, kind: str, name: str) -> Any:
        """Load an entry that not every dataset keeps; None where this one does not."""
        file = self._inputs / name
        return load(kind, file) if file.is_file() else None


@lru_cache(maxsize=2)
def catalogue_of(root: Path, scene: str | None = None) -> Catalogue:
    """Return a dataset's frozen inputs, and a scene of it.

    Parameters
    ----------
    root : of the dataset
    scene : as the scenario of a clip calls it; None is the dataset's one, or the first of several
    """
    return Catalogue(Layout(root).inputs, find_scene(read_plan(root).record_of(scene)), scene)
