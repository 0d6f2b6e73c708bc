"""Is a scene fit to be driven? Road below the route, nothing in the way, nothing afloat, and metres that are metres."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tasks.conventions import ROAD_CLASSES, SemanticClass
from tasks.scene.classify import HEIGHT_TOLERANCE
from tasks.scene.route_shape import sample_curvature, sample_grade
from tasks.scene.scene import Scene

Floats = NDArray[np.float64]

CELL = 2.0
"""Length of the stretches of a route in which the road is looked for [m]."""
TRACKS = (-0.75, 0.0, 0.75)
"""Lateral positions at which the road is looked for: the wheels' tracks and the middle between them [m]."""
LEAST_COVERAGE = 0.98
"""Share of the cells of the tracks that have road [1]."""
CLEAR = (0.9, 0.35, 2.3)
"""Half width, lowest and highest point of the space that the car takes [m]."""
MOST_IN_THE_WAY = 0.02
"""Area of discs in 2 m of that space [m2]: a leaf, not a branch."""
ALONE, MOST_ALONE = 2.5, 1e-4
"""Distance to the third neighbour over the size of a disc from which it floats, or 1.5 m; share of such discs [1]."""
SAMPLED = 5
"""Discs from one that is looked at to the next [1]."""
WIDTHS = (2.5, 40.0)
"""Least and greatest width of a carriageway [m]."""
TIGHTEST = 10.0
"""Least radius of a bend of a road [m]."""
VEHICLE_HEIGHTS = (1.1, 4.5)
"""Least and greatest height of the vehicles' tops above the road [m]."""


def measure_soundness(scene: Scene) -> dict[str, float]:
    """Return the figures that `find_faults` judges.

    Parameters
    ----------
    scene : with classes

    Returns
    -------
    ``road_coverage`` of the tracks and ``road_height``, the largest height of a cell's road above the route or below
    it [m]; ``in_the_way``, the largest area of discs in 2 m of the car's space [m2]; ``afloat``, the share of discs
    with no neighbours; ``width`` of the carriageway [m]; ``tightest_radius`` [m]; ``steepest_grade`` [1];
    ``vehicle_height`` beside the route, NaN without vehicles [m]; ``route_length`` [m].
    """
    cloud, route = scene.gaussians, scene.route
    points = cloud.means.astype(np.float64)
    station, lateral, height = route.project(points)
    on_route = (station >= 0) & (station <= route.length)
    cell = np.clip((station / CELL).astype(np.int64), 0, int(route.length / CELL))
    road = np.isin(cloud.class_id, ROAD_CLASSES) & on_route
    cells = max(int(route.length / CELL), 1)
    held = [
        len(np.unique(cell[road & (np.abs(lateral - track) < 0.4) & (cell < cells)])) / cells
        for track in TRACKS
    ]
    near = road & (np.abs(lateral) < 1.2) & (np.abs(height) < 2.0)
    heights = [float(np.median(height[near & (cell == k)])) for k in np.unique(cell[near])]
    half, low, high = CLEAR
    area = (
        2 * np.pi * np.prod(np.sort(cloud.scales, axis=1)[:, 1:].astype(np.float64), axis=1) * cloud.opacities
    )
    inside = on_route & (np.abs(lateral) < half) & (height > low) & (height < high)
    in_the_way = np.bincount(cell[inside], area[inside], minlength=1)
    _, curvature = sample_curvature(route)
    # beyond its end the route's line says nothing of the ground
    vehicles = (cloud.class_id == SemanticClass.VEHICLE) & on_route
    return {
        "road_coverage": float(np.min(held)),
        "road_height": float(np.max(np.abs(heights), initial=0.0)) if heights else float("nan"),
        "in_the_way": float(in_the_way.max()),
        "afloat": _measure_afloat(points, cloud.scales),
        "width": float(scene.carriageway_left - scene.carriageway_right),
        "tightest_radius": float(1 / max(np.abs(curvature).max(), 1e-9)),
        "steepest_grade": float(np.abs(sample_grade(route).rise).max()),
        "vehicle_height": float(np.quantile(height[vehicles], 0.98)) if vehicles.any() else float("nan"),
        "route_length": float(route.length),
    }


def find_faults(figures: dict[str, float], steepest_grade: float) -> list[str]:
    """Return a sentence for each figure of `measure_soundness` that no scene to drive in may have.

    Parameters
    ----------
    figures : of the scene
    steepest_grade : limit [1]
    """
    f = figures
    rules = {
        f"road must lie below {LEAST_COVERAGE:.0%} of the wheels' tracks; it does below {f['road_coverage']:.1%}": (
            f["road_coverage"] >= LEAST_COVERAGE
        ),
        f"the route must lie within {HEIGHT_TOLERANCE:g} m of the road; it is {f['road_height']:.2f} m off": (
            f["road_height"] <= HEIGHT_TOLERANCE
        ),
        f"nothing may stand where the car drives; {f['in_the_way']:.3f} m2 of discs do in {CELL:g} m": (
            f["in_the_way"] <= MOST_IN_THE_WAY
        ),
        f"at most {MOST_ALONE:.2%} of the discs may float without neighbours; {f['afloat']:.3%} do": (
            f["afloat"] <= MOST_ALONE
        ),
        f"a carriageway is {WIDTHS[0]:g} to {WIDTHS[1]:g} m wide; it is {f['width']:.1f} m: check the scale": (
            WIDTHS[0] <= f["width"] <= WIDTHS[1]
        ),
        f"bends must have a radius of {TIGHTEST:g} m or more; one has {f['tightest_radius']:.1f} m": (
            f["tightest_radius"] >= TIGHTEST
        ),
        f"the grade must be at most {steepest_grade:g}; it is {f['steepest_grade']:.3f}": (
            f["steepest_grade"] <= steepest_grade
        ),
        f"vehicles are {VEHICLE_HEIGHTS[0]:g} to {VEHICLE_HEIGHTS[1]:g} m high; they reach"
        f" {f['vehicle_height']:.2f} m: check the scale": (
            np.isnan(f["vehicle_height"]) or VEHICLE_HEIGHTS[0] <= f["vehicle_height"] <= VEHICLE_HEIGHTS[1]
        ),
    }
    return [rule for rule, kept in rules.items() if not kept]


def _measure_afloat(points: Floats, scales: NDArray[np.float32]) -> float:
    """Return the share of discs whose third neighbour is far away for their size [1]."""
    count = min(4, len(points))
    distance, _ = cKDTree(points).query(points[::SAMPLED], k=count)
    size = np.max(scales[::SAMPLED], axis=1)
    return float(np.mean(distance[:, -1] > np.maximum(1.5, ALONE * 2 * size)))
