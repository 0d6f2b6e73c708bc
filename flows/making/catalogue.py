"""The catalogue entries that a dataset was planned with, from its own frozen copies."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from catalogs.cameras import load_camera
from catalogs.gates import load_gates
from catalogs.hazard_markings import load_marking
from catalogs.low_speed import load_kept_low_speed
from catalogs.references import read_reference
from catalogs.road_grade import load_kept_grade
from catalogs.scenes import load_scene
from catalogs.studies import load_sensitivity_study
from catalogs.studies.ablation import FamilyWeather, load_kept_families
from catalogs.surfaces import load_surface
from catalogs.variants import Variant
from catalogs.vehicles import load_vehicle
from catalogs.weather.look import load_weather
from flows.making.places import find_scene
from flows.making.plan import read_plan
from flows.making.traced import Reference
from flows.store.layout import Layout
from manifests.manifest import TRACES
from tasks.eval.motion_agreement import PoseThresholds
from tasks.render.camera import Camera
from tasks.render.road_paint import HazardMarking
from tasks.render.weather.parameters import WeatherParameters
from tasks.scene.scene import Scene
from tasks.studies.sensitivity import StudyProtocol
from tasks.surface.road_profile import LEVEL_ROAD, RoadGrade
from tasks.surface.state import SurfaceParameters
from tasks.vehicle.paper.low_speed import SteadyStop
from tasks.vehicle.parameters import Vehicle


@dataclass(frozen=True, kw_only=True)
class Catalogue:
    """The entries that a dataset was planned with, read from the dataset's own frozen copies."""

    vehicle: Vehicle
    surface: SurfaceParameters
    camera: Camera
    scene: Scene
    weather: Path
    gates: PoseThresholds
    study: StudyProtocol
    marking: HazardMarking | None = None
    traces: Reference | None = None
    steady: SteadyStop | None = None
    families: FamilyWeather | None = None
    grade: RoadGrade = LEVEL_ROAD

    @property
    def weather_parameters(self) -> WeatherParameters:
        """Return how the weathers look; the entries are read when a picture first asks for them."""
        return _read_weather_parameters(self.weather)


@lru_cache(maxsize=2)
def _read_weather_parameters(folder: Path) -> WeatherParameters:
    return load_weather(folder)


@lru_cache(maxsize=2)
def catalogue_of(root: Path) -> Catalogue:
    """Load a dataset's frozen inputs and its scene."""
    plan = read_plan(root)
    return load_catalogue(Layout(root).inputs, find_scene(plan.scene), plan.settings.variant)


def load_catalogue(inputs: Path, scene: str, variant: Variant = "full") -> Catalogue:
    """Load frozen inputs from their folder, with those of a variant, and a scene."""
    return Catalogue(
        vehicle=load_vehicle(inputs / "vehicle.yaml", inputs / "weather"),
        surface=load_surface(inputs / "surface.yaml", inputs / "weather"),
        camera=load_camera(inputs / "camera.yaml"),
        scene=load_scene(scene),
        weather=inputs / "weather",
        gates=load_gates(inputs / "gates.yaml"),
        marking=load_marking(marking) if (marking := inputs / "hazard_marking.yaml").is_file() else None,
        study=load_sensitivity_study(inputs / "study.yaml")[0],
        traces=read_reference(traces) if (traces := inputs / TRACES).is_dir() else None,
        steady=load_kept_low_speed(inputs),
        families=load_kept_families(inputs, variant),
        grade=load_kept_grade(inputs),
    )
