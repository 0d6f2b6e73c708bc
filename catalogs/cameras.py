"""Cameras: picture size, focal length, and where they sit on the vehicle."""

from dataclasses import replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.spatial.transform import Rotation

from catalogs.quantities import Bounded, CatalogueEntry, Scalar, Text, require_quantity
from tasks.render.camera import Camera
from tasks.render.lens import Lens
from tasks.render.readout import sensor_field
from tasks.render.sensor import Sensor
from tasks.render.weather.random_streams import unit_number

Metres = Annotated[Scalar, require_quantity("m")]
Distortion = Annotated[Scalar, require_quantity("1", minimum=-2, maximum=2)]
Degrees = Annotated[Bounded | Scalar, require_quantity("deg", minimum=-45, maximum=45)]
LEVEL = Field(default=Scalar(value=0.0, unit="deg", source="level mount"))
NO_DISTORTION = Field(default=Scalar(value=0.0, unit="1", source="no distortion"))

LOOKING_FORWARD = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Camera axes (x right, y down, z forward) in rig axes (x forward, y left, z up)."""


DRAWN = ("focal_length", "pitch_down", "roll_right", "height_above_road")
"""Quantities of a camera that may have bounds, between which the visual seed of each clip draws its own."""


class CameraEntry(CatalogueEntry):
    """Content of a camera file."""

    name: Text
    width: Annotated[Scalar, require_quantity("px", minimum=16, maximum=8192)]
    height: Annotated[Scalar, require_quantity("px", minimum=16, maximum=8192)]
    focal_length: Annotated[Bounded | Scalar, require_quantity("px", above=0)]
    behind_front_axle: Metres
    left_of_centre: Metres
    height_above_road: Annotated[Bounded | Scalar, require_quantity("m", above=0)]
    exposure: Annotated[Scalar, require_quantity("s", above=0, maximum=0.1)]
    pitch_down: Degrees = LEVEL
    roll_right: Degrees = LEVEL
    exposure_compensation: Annotated[Scalar, require_quantity("EV", minimum=-8, maximum=8)] = Field(
        default=Scalar(value=0.0, unit="EV", source="as the clear clip")
    )
    full_well: Annotated[Scalar, require_quantity("e-", above=0)] | None = None
    read_noise: Annotated[Scalar, require_quantity("e-", minimum=0)] = Field(
        default=Scalar(value=0.0, unit="e-", source="no noise")
    )
    k1: Distortion = NO_DISTORTION
    k2: Distortion = NO_DISTORTION
    p1: Distortion = NO_DISTORTION
    p2: Distortion = NO_DISTORTION
    k3: Distortion = NO_DISTORTION
    line_delay: Annotated[Scalar, require_quantity("s", minimum=0, maximum=0.001)] = Field(
        default=Scalar(value=0.0, unit="s", source="one shutter for all rows")
    )
    motion_blur: bool = False

    def build(self, seed: int | None = None) -> Camera:
        """The camera itself; a lens that does not spread the whole picture is refused here, not in the first clip.

        Parameters
        ----------
        seed : visual seed of a clip, which draws what has bounds; None takes each value [1]
        """
        width, height = int(self.width.value), int(self.height.value)
        quantities = {name: getattr(self, name) for name in DRAWN}
        spread = {name: one.bounds for name, one in quantities.items() if isinstance(one, Bounded)}
        drawn = {name: _draw_value(name, one, seed) for name, one in quantities.items()}
        turn = Rotation.from_euler("YX", (drawn["pitch_down"], drawn["roll_right"]), degrees=True)
        mount = np.eye(4)
        mount[:3, :3] = turn.as_matrix() @ LOOKING_FORWARD
        mount[:3, 3] = -self.behind_front_axle.value, self.left_of_centre.value, drawn["height_above_road"]
        k = {name: getattr(self, name).value for name in ("k1", "k2", "p1", "p2", "k3")}
        camera = Camera(
            name=self.name,
            width=width,
            height=height,
            K=_make_intrinsics(drawn["focal_length"], width, height),
            T_rig_camera=mount,
            exposure_s=self.exposure.value,
            sensor=Sensor(
                exposure_ev=self.exposure_compensation.value,
                full_well=None if self.full_well is None else self.full_well.value,
                read_noise=self.read_noise.value,
            ),
            lens=Lens(**k) if any(k.values()) else None,
            line_delay_s=self.line_delay.value,
            motion_blur=self.motion_blur,
            spread=spread,
        )
        widest, _ = spread.get("focal_length", (drawn["focal_length"], None))
        sensor_field(replace(camera, K=_make_intrinsics(widest, width, height)))
        return camera


def _make_intrinsics(focal_px: float, width: int, height: int) -> NDArray[np.float64]:
    return np.array([[focal_px, 0.0, width / 2], [0.0, focal_px, height / 2], [0.0, 0.0, 1.0]])


def _draw_value(name: str, quantity: Scalar, seed: int | None) -> float:
    if seed is None or not isinstance(quantity, Bounded):
        return quantity.value
    low, high = quantity.bounds
    return low + (high - low) * unit_number(seed, f"camera {name}")
