"""Commands that build scenes from recordings and other tools, and render single frames of them."""

from typing import Any

from flows.commands.command import BACKEND, OUT, Command, define_argument, define_option, require_key
from tasks.conventions import POSE_FORMS

GROUP = "Scenes"
SUN = define_option(
    "sun_direction_deg",
    tuple[float, float] | None,
    "Azimuth and elevation of the sun [deg]: azimuth 0 is ahead at the start, 90 left; elevation 0 is the horizon.",
    None,
    spelling="sun",
)
SCENE_OUT = define_option("out", str, "Scene folder to make.")

SCENES = define_option(
    "scenes",
    list[str] | None,
    "Folder, or street such as town-7; may be given more than once. By default the first streets of each kind.",
    None,
    spelling="scene",
)

STREETS = define_option("streets", int, "Streets of each kind, where no scene is named.", 4)


def shorten_check(result: dict[str, Any]) -> dict[str, Any]:
    """Return the check with a row for each scene that has faults, and the figures that differ most."""
    kept = ("scene", "road_coverage", "in_the_way", "afloat", "holes", "ratio")
    rows = [
        {key: row[key] for key in kept if key in row} | {"faults": "; ".join(row["faults"])}
        for row in result["scenes"]
    ]
    return result | {"scenes": rows}


COMMANDS = (
    Command(
        name="scene from-stereo",
        group=GROUP,
        sentence="Build a Gaussian scene from a posed stereo sequence.",
        function="flows.making.reconstruction:scene_from_stereo",
        options=(
            define_argument("folder", str, "Folder with calib.txt, poses.txt, image_l/ and image_r/."),
            SCENE_OUT,
            SUN,
        ),
    ),
    Command(
        name="scene import",
        group=GROUP,
        sentence="Make a scene of Gaussians trained elsewhere and a route through them.",
        function="flows.making.scenes:scene_import",
        options=(
            define_argument("gaussians", str, ".ply, compressed .ply, .splat or .spz file."),
            define_option(
                "route",
                str,
                "Route: CSV of points, poses of KITTI, KITTI-360 or TUM, 4x4 matrices a line, COLMAP's images.txt or"
                " images.bin, or nerfstudio's transforms.json.",
            ),
            SCENE_OUT,
            define_option("camera_height", float, "Height of the route's cameras above the road [m].", 1.5),
            define_option("half_width", float, "Half the carriageway's width [m].", 3.5),
            define_option("metres_per_unit", float, "Length of one unit of the files [m].", 1.0),
            define_option(
                "poses",
                str | None,
                f"Form of the route's poses: {', '.join(POSE_FORMS)}; by default that of the kind of file.",
                None,
                known=tuple(POSE_FORMS),
            ),
            define_option(
                "dataparser",
                str | None,
                "dataparser_transforms.json of a cloud that nerfstudio exported: leads from the route's frame to it.",
                None,
            ),
            SUN,
        ),
        passed=require_key("road_found"),
    ),
    Command(
        name="scene gallery",
        group=GROUP,
        sentence="Draw a sheet of scenes along their routes.",
        function="flows.making.scene_views:show_scenes",
        options=(SCENES, STREETS, define_option("out", str, "Folder for gallery.png."), BACKEND),
    ),
    Command(
        name="scene check",
        group=GROUP,
        sentence="Check scenes for holes, floating parts, a route off the road, and their scale.",
        function="flows.making.scene_views:check_scenes",
        options=(SCENES, STREETS, OUT, BACKEND),
        brief=shorten_check,
        passed=require_key("sound"),
    ),
    Command(
        name="scene render",
        group=GROUP,
        sentence="Render one frame of a scene at a world-to-camera pose.",
        function="flows.making.scenes:render_pose",
        options=(
            define_argument("scene", str, "Scene folder, or the name of a built-in street."),
            define_option(
                "pose", str, "JSON file: viewmat (4x4, world to camera), K (3x3) [px], width and height [px]."
            ),
            define_option(
                "out", str, "Folder for rgb.png, and for depth, opacity, normals and classes as .npy files."
            ),
            BACKEND,
        ),
    ),
)
