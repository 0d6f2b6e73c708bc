"""Dimensions and light of the built-in street, and the finest detail that a camera on its route resolves."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tasks.errors import InputError
from tasks.scene.street.course import Stretches

EYE_HEIGHT = 1.4
"""Height of the camera the street is sampled for [m]."""
VIEW_SLOPE = (0.6, 0.4)
"""Half width and half height of that camera's picture at unit depth [1]: 480x320 at a focal length of 400."""
PIXEL = 1 / 400
"""Width of one of its pixels at unit depth [1]."""


MAY_BE_NONE = (
    "parking_width", "crossing_length", "kerb_height", "kerb_width", "pavement_width", "front_garden", "open_ground",
    "shoulder_width", "lamp_spacing", "tree_spacing", "delineator_spacing", "sign_spacing", "wire_spacing",
    "boundary_distance",
)  # fmt: skip
"""Lengths of a `StreetLayout` that may be 0, where the street has no such thing."""


@dataclass(frozen=True, kw_only=True)
class StreetLayout:
    """A two-lane street: the ego route in the right lane, parking, pavement and facades on both sides.

    Parameters
    ----------
    route_length : length of the ego route [m]
    behind, beyond : how far the street goes on before and after the route [m]
    course : bends and hills of the road
    lane_width : width of a traffic lane [m]
    parking_width : width of the parking strip, or of the shoulder, on either side [m]
    parked_share : share of the parking places that are taken [1]
    marking_width : width of a longitudinal marking [m]
    dash_length, dash_gap : stroke and gap of the centre line [m]
    crossing_station : where the pedestrian crossing begins [m]
    crossing_length : extent of the crossing along the road; 0 for none [m]
    crossing_bar : width of a bar of the crossing, and of the gap between two [m]
    kerb_height, kerb_width : upstand and top width of the kerb [m]
    pavement_width : of the paved footway beside the kerb; 0 for none [m]
    front_garden : from the pavement to the facades; 0 without gardens [m]
    open_ground : grass beyond the pavement, under gardens and houses and behind them; 0 without [m]
    slab : edge of a paving slab [m]
    ground_storey_height, storey_height : floor to floor [m]
    built_share : share of the lots with a house [1]
    fewest_storeys, most_storeys : of a house, the ground floor among them [1]
    fewest_bays, most_bays : window bays of a front [1]
    gap_share : share of the houses after which there is a gap [1]
    shortest_gap, longest_gap : such gaps [m]
    shop_share : share of the houses with a shop [1]
    cladding_share : share of the fronts of sheet metal [1]
    flat_share, mansard_share : share of flat and of mansard roofs; the others are pitched [1]
    hedge_share, fence_share, wall_share, mesh_share : share of the lots that a hedge, a wooden fence, a wall or a wire
        fence closes off the road; the others are open [1]
    boundary_distance : from the pavement to hedge, fence or wall [m]
    shortest_lot, longest_lot : length of a lot along the road [m]
    rail_share : share of the road's sides that has a guard rail [1]
    delineator_spacing, sign_spacing, wire_spacing : of delineators, traffic signs, and poles with wires; 0 for none [m]
    ground_trees_scale : trees on the open ground of either side, in 100 m of road [1]
    canyon_height : mean height of the houses, which hide the low sky [m]
    lamp_spacing, lamp_height : of the street lamps on one side; no lamps with a spacing of 0 [m]
    tree_spacing : between the trees of one side; 0 for none [m]
    tree_share : share of the places of trees that are planted [1]
    tree_scale : size of a tree over that of a young lime of 7 m [1]
    leaf_share, autumn_share : share of the leaves that hang, and of these that have turned [1]
    dead_grass_share : share of the grass that is yellow [1]
    yellow_share : share of the streets whose centre line is yellow, not white [1]
    bare_share : share of the open ground that lies bare; the grass about it is dry [1]
    shoulder_width : bare strip beside the road or pavement; 0 for none [m]
    asphalt_scale : reflectance of the asphalt over that of an old town street [1]
    wear_scale : cracks and repairs over those of an old town street [1]
    track_scale, strip_scale : reflectance of a lane's wheel tracks, and of the strip between them, over the rest [1]
    renewal_spacing : mean length of a lane's stretches of one age [m]
    renewal_scale : standard deviation of the logarithm of their reflectance [1]
    sun_azimuth_deg : direction of the sun, from the route's start heading to the left [deg]
    sun_elevation_deg : height of the sun [deg]
    sun_rgb : irradiance of the sun over pi, on a surface that faces it, linear light [1]
    sky_rgb : irradiance of the whole sky over pi, linear light [1]
    bounce_rgb : radiance of the sunlit surroundings, linear light [1]
    """

    route_length: float
    behind: float
    beyond: float
    course: Stretches
    lane_width: float
    parking_width: float
    parked_share: float
    marking_width: float
    dash_length: float
    dash_gap: float
    crossing_station: float
    crossing_length: float
    crossing_bar: float
    kerb_height: float
    kerb_width: float
    pavement_width: float
    front_garden: float
    open_ground: float
    slab: float
    ground_storey_height: float
    storey_height: float
    built_share: float
    fewest_storeys: float
    most_storeys: float
    fewest_bays: float
    most_bays: float
    gap_share: float
    shortest_gap: float
    longest_gap: float
    shop_share: float
    cladding_share: float
    flat_share: float
    mansard_share: float
    hedge_share: float
    fence_share: float
    wall_share: float
    mesh_share: float
    boundary_distance: float
    shortest_lot: float
    longest_lot: float
    rail_share: float
    delineator_spacing: float
    sign_spacing: float
    wire_spacing: float
    ground_trees_scale: float
    canyon_height: float
    lamp_spacing: float
    lamp_height: float
    tree_spacing: float
    tree_share: float
    tree_scale: float
    leaf_share: float
    autumn_share: float
    dead_grass_share: float
    yellow_share: float
    bare_share: float
    shoulder_width: float
    asphalt_scale: float
    wear_scale: float
    track_scale: float
    strip_scale: float
    renewal_spacing: float
    renewal_scale: float
    sun_azimuth_deg: float
    sun_elevation_deg: float
    sun_rgb: tuple[float, float, float]
    sky_rgb: tuple[float, float, float]
    bounce_rgb: tuple[float, float, float]

    def __post_init__(self) -> None:
        if self.has_crossing and not 0 < self.crossing_station < self.route_length - self.crossing_length:
            raise InputError(
                f"the crossing must lie on the route of {self.route_length:g} m; it is {self.crossing_length:g} m"
                f" long and begins at crossing_station {self.crossing_station:g} m"
            )

    @property
    def has_crossing(self) -> bool:
        """Whether pedestrians have a crossing."""
        return self.crossing_length > 0

    @property
    def has_pavement(self) -> bool:
        """Whether there is a kerb with a paved footway behind it."""
        return self.pavement_width > 0

    @property
    def carriageway_left(self) -> float:
        """Lateral position of the left kerb from the route [m]."""
        return 1.5 * self.lane_width + self.parking_width

    @property
    def carriageway_right(self) -> float:
        """Lateral position of the right kerb from the route [m], negative."""
        return -(0.5 * self.lane_width + self.parking_width)

    @property
    def station_range(self) -> tuple[float, float]:
        """First and last station that is built [m]."""
        return -self.behind, self.route_length + self.beyond

    def kerb_position(self, side: int) -> float:
        """Lateral position of the kerb on the left (side 1) or the right (side -1) [m]."""
        return self.carriageway_left if side > 0 else self.carriageway_right

    def front_position(self, side: int) -> float:
        """Lateral position of the facades on the left (side 1) or the right (side -1) [m]."""
        return self.pavement_end(side) + side * self.front_garden

    def pavement_end(self, side: int) -> float:
        """Lateral position at which the pavement ends on the left (side 1) or the right (side -1) [m]."""
        return self.kerb_position(side) + side * (self.kerb_width + self.pavement_width)


def nearest_depth(
    layout: StreetLayout, station: ArrayLike, lateral: ArrayLike, height: ArrayLike = 0.0
) -> NDArray[np.float64]:
    """Return the depth at which a point first enters the picture of a camera driving the route.

    It bounds the visible detail there, and so determines the size of the Gaussians.

    Parameters
    ----------
    layout : the street
    station, lateral, height : the point in route coordinates, broadcast together [m]

    Returns
    -------
    float64, shape of the broadcast: depth [m]; points behind the start count as far away, since a
        camera that faces forward never shows them
    """
    s, d, z = np.broadcast_arrays(*(np.asarray(x, dtype=np.float64) for x in (station, lateral, height)))
    edge = np.maximum(np.abs(d) / VIEW_SLOPE[0], np.abs(z - EYE_HEIGHT) / VIEW_SLOPE[1])
    ahead = s - layout.route_length
    behind = np.where(s < -2.0, 12.0 - s, 0.0)
    return np.maximum(np.maximum(edge, ahead), np.maximum(behind, EYE_HEIGHT / VIEW_SLOPE[1]))
