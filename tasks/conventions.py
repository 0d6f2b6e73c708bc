"""Axes, classes and channel names: the one table from which Parquet, Zarr and the docs are labelled.

ISO 8855 vehicle axes: x forward, y left, z up; pitch positive nose-down, heave positive up.
Camera axes: x right, y down, z forward. Poses are 4x4 matrices ``T_a_b`` taking b-coordinates to a;
quaternions are wxyz. SI units; any other unit stands in the name. NaN means "not represented".
"""

from dataclasses import dataclass
from enum import IntEnum


class SemanticClass(IntEnum):
    """Class of a Gaussian, and so of a pixel. 0 is a pixel that no Gaussian covers."""

    SKY = 0
    ROAD = 1
    MARKING = 2
    KERB = 3
    SIDEWALK = 4
    BUILDING = 5
    VEGETATION = 6
    VEHICLE = 7
    POLE = 8
    TERRAIN = 9
    OTHER = 10


GRAVITY = 9.80665
"""Standard acceleration of free fall (CGPM 1901) [m/s2]."""
ROAD_CLASSES = (SemanticClass.ROAD, SemanticClass.MARKING)
"""Classes that hold the water film and the snow cover, and that follow the road profile."""
ANY_HEADING = "any-heading"
POSE_FORMS = {
    "opencv": "the camera's axes may be x right, y down, z forward (OpenCV)",
    "scalar-first": "the quaternions may begin with their scalar, qw qx qy qz",
    "world-to-camera": "the matrices may lead from the world to the camera",
    "opengl": "the camera's axes may be x right, y up, z back (OpenGL)",
    "flu": "the poses may be a vehicle's, x forward, y left, z up",
    "frd": "the poses may be a vehicle's, x forward, y right, z down",
    ANY_HEADING: "the camera may look {side}",
}
"""Forms in which camera poses are written, and what is likely of a file that fits one."""


@dataclass(frozen=True, kw_only=True)
class Channel:
    """One telemetry column: its name, unit, the paper's symbol and, where CF has one, the standard name."""

    name: str
    unit: str
    symbol: str
    description: str
    standard_name: str = ""


def _add_percentiles(name: str, unit: str, symbol: str, description: str) -> tuple[Channel, ...]:
    """Return the channels of a figure's percentiles."""
    bounds = "under the paper's bounds of the surface parameters (Appendix E)"
    return tuple(
        Channel(name=f"{name}_{short}", unit=unit, symbol=symbol, description=f"{title}, {bounds}, of: {description}")
        for short, title in (("p05", "5th percentile"), ("p50", "median"), ("p95", "95th percentile"))
    )  # fmt: skip


TICK_CHANNELS: tuple[Channel, ...] = (
    Channel(name="t_ns", unit="ns", symbol="t", description="time since the start of the clip", standard_name="time"),
    Channel(name="station", unit="m", symbol="s", description="front-axle route coordinate"),
    Channel(name="speed", unit="m s-1", symbol="v", description="longitudinal speed", standard_name="platform_speed_wrt_ground"),
    Channel(name="longitudinal_acceleration", unit="m s-2", symbol="dv/dt", description="rate of change of speed"),
    Channel(name="braking_slip_f", unit="1", symbol="kappa_f", description="braking slip, front axle (ISO slip is its negative)"),
    Channel(name="braking_slip_r", unit="1", symbol="kappa_r", description="braking slip, rear axle (ISO slip is its negative)"),
    Channel(name="wheel_speed_f", unit="rad s-1", symbol="omega_f", description="wheel angular speed, front axle"),
    Channel(name="wheel_speed_r", unit="rad s-1", symbol="omega_r", description="wheel angular speed, rear axle"),
    Channel(name="tyre_force_f", unit="N", symbol="F_x,f", description="longitudinal braking force, front axle, rearward positive"),
    Channel(name="tyre_force_r", unit="N", symbol="F_x,r", description="longitudinal braking force, rear axle, rearward positive"),
    Channel(name="axle_load_f", unit="N", symbol="F_z,f", description="half-car contact load, front axle; half of it per wheel"),
    Channel(name="axle_load_r", unit="N", symbol="F_z,r", description="half-car contact load, rear axle; half of it per wheel"),
    Channel(name="tyre_load_f", unit="N", symbol="F_z,f^tyre", description="the load that fed the front tyre force"),
    Channel(name="tyre_load_r", unit="N", symbol="F_z,r^tyre", description="the load that fed the rear tyre force"),
    Channel(name="brake_torque_f", unit="N m", symbol="T_b,f", description="brake torque after ABS, front axle"),
    Channel(name="brake_torque_r", unit="N m", symbol="T_b,r", description="brake torque after ABS, rear axle"),
    Channel(name="abs_scale_f", unit="1", symbol="q_f", description="share of the commanded torque that ABS lets through, front"),
    Channel(name="abs_scale_r", unit="1", symbol="q_r", description="share of the commanded torque that ABS lets through, rear"),
    Channel(name="brake_pressure_mpa", unit="MPa", symbol="p_b", description="commanded brake pressure"),
    Channel(name="heave", unit="m", symbol="z_s", description="body heave about static equilibrium, up positive", standard_name="platform_heave"),
    Channel(name="heave_rate", unit="m s-1", symbol="dz_s/dt", description="rate of heave"),
    Channel(name="pitch", unit="rad", symbol="theta", description="body pitch about static equilibrium, nose-down positive", standard_name="platform_pitch_fore_down"),
    Channel(name="pitch_rate", unit="rad s-1", symbol="dtheta/dt", description="rate of pitch"),
    Channel(name="unsprung_heave_f", unit="m", symbol="z_u,f", description="front axle height about static equilibrium"),
    Channel(name="unsprung_heave_r", unit="m", symbol="z_u,r", description="rear axle height about static equilibrium"),
    Channel(name="road_height_f", unit="m", symbol="z_r,f", description="road elevation under the front axle"),
    Channel(name="road_height_r", unit="m", symbol="z_r,r", description="road elevation under the rear axle"),
    Channel(name="road_grade", unit="1", symbol="i", description="grade of the route under the front axle beside the road feature: rise per metre of way, uphill positive"),
    Channel(name="road_force", unit="N", symbol="F_x,road", description="longitudinal force of the road feature's slope, forward positive"),
    Channel(name="contact_f", unit="1", symbol="", description="front axle touches the road"),
    Channel(name="contact_r", unit="1", symbol="", description="rear axle touches the road"),
)  # fmt: skip

FRAME_CHANNELS: tuple[Channel, ...] = (
    Channel(name="frame", unit="1", symbol="", description="frame number in the clip"),
    Channel(name="tick", unit="1", symbol="", description="row of the tick table that the frame shows"),
    Channel(name="T_world_rig", unit="1", symbol="P", description="rig-to-world pose with heave and pitch, 4x4 row-major; translation in m"),
    Channel(name="recovered_pitch", unit="rad", symbol="theta^", description="pitch recovered from the finished frames, relative to frame 0"),
    Channel(name="recovered_progress", unit="m", symbol="p^", description="forward progress recovered from the finished frames"),
)  # fmt: skip

CLIP_CHANNELS: tuple[Channel, ...] = (
    Channel(name="precipitation_mm_h", unit="mm h-1", symbol="r", description="rain rate, or water-equivalent snow rate"),
    Channel(name="snow_accumulation_h", unit="h", symbol="tau_s", description="time over which the snow has fallen"),
    Channel(name="initial_speed_km_h", unit="km h-1", symbol="v_0", description="speed at the start of the clip"),
    Channel(name="peak_pressure_mpa", unit="MPa", symbol="p_b", description="brake pressure after the ramp"),
    Channel(name="ramp_s", unit="s", symbol="", description="rise time of the brake pressure"),
    Channel(name="hold_s", unit="s", symbol="", description="time at the peak pressure; null to the end"),
    Channel(name="release_s", unit="s", symbol="", description="fall time of the brake pressure"),
    Channel(name="brake_onset_s", unit="s", symbol="t_b", description="brake onset by time"),
    Channel(name="brake_onset_m", unit="m", symbol="", description="brake onset by route position"),
    Channel(name="hold_speed", unit="", symbol="", description="the speed is held until the brake onset, without one throughout; else the car coasts"),
    Channel(name="hazard_center_m", unit="m", symbol="s_g", description="route coordinate of the road feature's centre"),
    Channel(name="hazard_length_m", unit="m", symbol="L_g", description="length of the road feature"),
    Channel(name="hazard_height_m", unit="m", symbol="A_g", description="height of the road feature; negative is a depression"),
    Channel(name="film_depth_mm", unit="mm", symbol="h_t", description="total depth of the film of water or ice"),
    Channel(name="snow_depth_mm", unit="mm", symbol="h_s", description="snow depth"),
    Channel(name="snow_coverage", unit="1", symbol="c_s", description="snow coverage of the road"),
    Channel(name="surface_friction", unit="1", symbol="mu_c", description="reference surface coefficient"),
    Channel(name="tyre_peak", unit="1", symbol="mu_eff", description="effective peak of the tyre curve"),
    Channel(name="stop_time", unit="s", symbol="t_s", description="time of the stop since the start of the clip"),
    Channel(name="stopping_distance", unit="m", symbol="d_stop", description="distance from brake onset to the stop"),
    Channel(name="peak_pitch", unit="rad", symbol="", description="largest nose-down pitch of the clip"),
    *_add_percentiles("surface_friction", "1", "mu_c", "reference surface coefficient"),
    *_add_percentiles("stopping_distance", "m", "d_stop", "distance from brake onset to the stop; null where the clip ends before it"),
    *_add_percentiles("peak_pitch", "rad", "", "largest nose-down pitch of the clip"),
    Channel(name="wheel_lift_time_f", unit="s", symbol="", description="time for which the front axle is off the road; above 0 the unilateral contact acts, and the sum of road and brake response (paper mode) is an approximation"),
    Channel(name="wheel_lift_time_r", unit="s", symbol="", description="time for which the rear axle is off the road; above 0 the unilateral contact acts, and the sum of road and brake response (paper mode) is an approximation"),
    Channel(name="peak_deceleration", unit="m s-2", symbol="", description="largest deceleration of the clip; 0 where the car never slows down"),
    Channel(name="peak_pitch_rate", unit="rad s-1", symbol="", description="largest pitch rate of the clip, either way"),
    Channel(name="abs_time", unit="s", symbol="", description="time for which ABS holds back torque of either axle"),
    Channel(name="peak_slip", unit="1", symbol="", description="largest braking slip of either axle"),
    Channel(name="lateral_demand", unit="m s-2", symbol="", description="largest lateral acceleration that the route's bends ask, speed squared times curvature; the model brakes with all of the grip, surface friction times g, as on a straight road"),
    Channel(name="collided", unit="", symbol="", description="the front of the car met a road user; null without road users, as the next four"),
    Channel(name="impact_speed", unit="m s-1", symbol="", description="speed over that of the road user that was met first, along the route; 0 where none was met"),
    Channel(name="min_ttc", unit="s", symbol="", description="smallest time to collision, gap over closing speed, with a road user in the path; 0 where one was met, null where no gap closed"),
    Channel(name="clearance", unit="m", symbol="", description="smallest gap from the front to a road user in the path; 0 where one was met, null where none was in the path"),
    Channel(name="avoided_speed", unit="m s-1", symbol="", description="impact speed of a car that keeps its speed, less impact_speed; null for tracks by world_m"),
    *_add_percentiles("impact_speed", "m s-1", "", "impact_speed; a policy's pressures stay those that it asked for"),
    *_add_percentiles("min_ttc", "s", "", "min_ttc"),
    *_add_percentiles("clearance", "m", "", "clearance"),
    *_add_percentiles("avoided_speed", "m s-1", "", "avoided_speed"),
    Channel(name="static_pitch", unit="rad", symbol="theta_0", description="pitch of the resting body, not contained in the pitch column"),
)  # fmt: skip

IDENTITY_CHANNELS: tuple[Channel, ...] = (
    Channel(name="clip_id", unit="", symbol="", description="content id of the clip, the join key of every table"),
    Channel(name="index", unit="1", symbol="", description="number of the clip in the dataset, and in the Zarr arrays"),
    Channel(name="label", unit="", symbol="", description="the clip's levels of the grid's axes"),
    Channel(name="seed", unit="", symbol="", description="visual seed, 64 bit, as text"),
    Channel(name="split", unit="", symbol="", description="the grid's split that the clip belongs to; empty where it names none"),
    Channel(name="calibration", unit="", symbol="", description="in-grid, interpolated, off-grid or beyond-calibration, as the paper's Appendix C says it"),
    Channel(name="weather", unit="", symbol="w", description="kind of weather; also the name of the tyre family"),
    Channel(name="calibration_extrapolated", unit="", symbol="", description="mu_c lies outside the calibrated knots, whose end values hold"),
)  # fmt: skip

CHECK_CHANNELS: tuple[Channel, ...] = (
    Channel(name="quarantined", unit="", symbol="", description="the pose check failed: kept and marked, left out of training windows unless asked for"),
    Channel(name="check_method", unit="", symbol="", description="pose check that judged the finished frames"),
    Channel(name="check_passed", unit="", symbol="", description="every judged figure keeps its threshold; null without frames, and where the check sees too little to judge (check_method is set)"),
    Channel(name="check_pitch_rmse_deg", unit="deg", symbol="", description="RMSE of recovered against claimed pitch, both from frame 0"),
    Channel(name="check_pitch_relative_error", unit="1", symbol="", description="the same over the RMS of the claimed pitch"),
    Channel(name="check_pitch_correlation", unit="1", symbol="", description="Pearson's, recovered against claimed pitch"),
    Channel(name="check_claimed_pitch_rms_deg", unit="deg", symbol="", description="RMS of the claimed pitch from frame 0"),
    Channel(name="check_progress_rmse_m", unit="m", symbol="", description="RMSE of recovered against claimed forward progress"),
    Channel(name="check_normalised_progress_rmse", unit="1", symbol="", description="the same over the whole progress"),
    Channel(name="check_failed_frames", unit="1", symbol="", description="frames without a recovered pose"),
    Channel(name="check_judged_frames", unit="1", symbol="", description="frames after the first with a recovered pose; without any, every figure of the check is null"),
    Channel(name="check_roll_rmse_deg", unit="deg", symbol="", description="RMSE of recovered roll against the route's, both from frame 0"),
    Channel(name="check_yaw_rmse_deg", unit="deg", symbol="", description="RMSE of recovered yaw against the route's, both from frame 0"),
    Channel(name="check_lateral_rmse_m", unit="m", symbol="", description="RMSE of the recovered rig's place to the left of the claimed one"),
    Channel(name="check_rise_rmse_m", unit="m", symbol="", description="RMSE of the recovered rig's place above the claimed one"),
    Channel(name="check_heave_gain", unit="1", symbol="", description="recovered over claimed heave, by least squares of changes over two frames"),
    Channel(name="check_heave_gain_std", unit="1", symbol="", description="standard uncertainty of the heave gain; a large one leaves it unjudged"),
)  # fmt: skip

PAIR_CHANNELS: tuple[Channel, ...] = (
    Channel(name="clip_id_a", unit="", symbol="", description="the sibling that comes first in the dataset"),
    Channel(name="clip_id_b", unit="", symbol="", description="the other sibling"),
    Channel(name="label_a", unit="", symbol="", description="label of the first"),
    Channel(name="label_b", unit="", symbol="", description="label of the other"),
    Channel(name="control", unit="", symbol="", description="the one control in which they differ: weather, speed, braking, road, scene or road users"),
    Channel(name="differs", unit="", symbol="", description="the scenario fields of that control whose values differ"),
    Channel(name="surface_friction_change", unit="1", symbol="Delta mu_c", description="reference surface coefficient, b minus a"),
    Channel(name="tyre_peak_change", unit="1", symbol="Delta mu_eff", description="effective peak of the tyre curve, b minus a"),
    Channel(name="stopping_distance_change", unit="m", symbol="Delta d_stop", description="distance from brake onset to the stop, b minus a"),
    Channel(name="peak_pitch_change", unit="rad", symbol="", description="largest nose-down pitch, b minus a"),
)  # fmt: skip

OBJECT_CHANNELS: tuple[Channel, ...] = (
    Channel(name="object", unit="1", symbol="", description="number of the road user in its clip, from 1 on, and in the array of instances"),
    Channel(name="kind", unit="", symbol="", description="kind of the road user"),
    Channel(name="box_left", unit="px", symbol="", description="left edge of the pixels that show it; null where none does, as the other edges, and in tables of frames that are not stored"),
    Channel(name="box_top", unit="px", symbol="", description="upper edge of these pixels"),
    Channel(name="box_right", unit="px", symbol="", description="right edge of these pixels, behind the last"),
    Channel(name="box_bottom", unit="px", symbol="", description="lower edge of these pixels, behind the last"),
    Channel(name="visible_pixels", unit="1", symbol="", description="number of these pixels; 0 in tables of frames that are not stored"),
    Channel(name="visibility", unit="1", symbol="", description="share of its surface towards the camera, inside the picture, that nothing else hides; null where none is inside"),
    Channel(name="truncation", unit="1", symbol="", description="share of its surface towards the camera that lies outside the picture"),
    Channel(name="size", unit="m", symbol="", description="length, width and height of its box"),
    Channel(name="centre_world", unit="m", symbol="", description="middle of its box in the world"),
    Channel(name="rotation_world", unit="1", symbol="", description="rotation of its box into the world, quaternion wxyz; x is forward"),
    Channel(name="centre_rig", unit="m", symbol="", description="middle of its box in the axes of the rig, T_world_rig"),
    Channel(name="rotation_rig", unit="1", symbol="", description="rotation of its box into the axes of the rig, quaternion wxyz"),
    Channel(name="velocity_world", unit="m s-1", symbol="", description="its velocity in the world"),
    Channel(name="velocity_rig", unit="m s-1", symbol="", description="the same over ground, in the axes of the rig"),
)  # fmt: skip
"""Columns of the table of road users beside the frame, a row a frame and road user."""

SOME_CLIPS_CHANNELS = (
    Channel(name="variant", unit="", symbol="", description="coupling that is cut on purpose, as in the paper's ablation: the picture is the scenario's, the motion is not; a sound dataset has no such column"),
    Channel(name="scene", unit="", symbol="", description="scene that the clip drives in; of a dataset with several"),
    Channel(name="falling", unit="", symbol="", description="rain or snow falls in the picture; false where it has ended and the road is as it left it"),
    Channel(name="sky", unit="", symbol="", description="kind of sky; null is closed cloud where it falls, on ice and in fog, else what the visual seed draws"),
    Channel(name="sun_azimuth_deg", unit="degree", symbol="", description="direction of the sun, from world +x towards +y; null is what the visual seed draws"),
    Channel(name="sun_elevation_deg", unit="degree", symbol="", description="height of the sun above the horizon; null is what the visual seed draws"),
    Channel(name="visual_range_m", unit="m", symbol="", description="meteorological optical range of fog; its extinction is 3.0 over it; null without fog"),
    Channel(name="focal_length_px", unit="px", symbol="", description="focal length of the camera, of a dataset whose clips draw their own"),
    Channel(name="camera_height", unit="m", symbol="", description="height of the camera above the road, of such a dataset"),
    Channel(name="camera_pitch", unit="rad", symbol="", description="pitch of the camera on the body, nose-down positive, of such a dataset"),
    Channel(name="camera_roll", unit="rad", symbol="", description="roll of the camera on the body, to the right positive, of such a dataset"),
)  # fmt: skip
"""Columns of the clips table that a dataset has only where its grid asks for something that it needs them for."""

CHANNELS_BY_NAME: dict[str, Channel] = {
    c.name: c
    for c in (
        *SOME_CLIPS_CHANNELS, *IDENTITY_CHANNELS, *TICK_CHANNELS, *FRAME_CHANNELS, *CLIP_CHANNELS, *CHECK_CHANNELS, *PAIR_CHANNELS,
        *OBJECT_CHANNELS,
    )
}  # fmt: skip

ESSENTIAL = frozenset({
    *(channel.name for channel in IDENTITY_CHANNELS),
    *(channel.name for channel in PAIR_CHANNELS if not channel.unit),
    "t_ns", "station", "speed", "heave", "pitch", "frame", "tick", "T_world_rig",
})  # fmt: skip
"""Columns that every dataset has: a table of theirs without one is damaged.

A dataset's own tables decide what it has of the others: a column that came later is not represented.
"""
