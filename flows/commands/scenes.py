"""Scenes from recordings and other tools, and single frames of them."""

from typing import Annotated

import typer

from flows.commands.console import Json, call, show

app = typer.Typer()
scene_app = typer.Typer(no_args_is_help=True, help="Build a scene from recordings or other tools.")
Sun = Annotated[
    tuple[float, float] | None,
    typer.Option(
        help="Azimuth and elevation of the sun [deg]: 0 ahead at the start, 90 to the left; 0 at the horizon."
    ),
]
app.add_typer(scene_app, name="scene")


@scene_app.command("from-stereo")
def scene_from_stereo(
    folder: Annotated[str, typer.Argument(help="calib.txt, poses.txt, image_l/, image_r/.")],
    out: Annotated[str, typer.Option(help="Scene folder to make.")],
    sun: Sun = None,
    as_json: Json = False,
) -> None:
    """Build a Gaussian scene from a posed stereo sequence."""
    show(call("scene_from_stereo", False, folder, out, sun_direction_deg=sun), as_json)


@scene_app.command("import")
def scene_import(
    gaussians: Annotated[str, typer.Argument(help=".ply, compressed .ply, .splat or .spz file.")],
    route: Annotated[str, typer.Option(help="Route: CSV, KITTI poses, TUM or nerfstudio transforms.json.")],
    out: Annotated[str, typer.Option(help="Scene folder to make.")],
    camera_height: Annotated[
        float, typer.Option(help="Height of the route's cameras above the road [m].")
    ] = 1.5,
    half_width: Annotated[float, typer.Option(help="Half the carriageway's width [m].")] = 3.5,
    metres_per_unit: Annotated[float, typer.Option(help="Metres in one unit of the files.")] = 1.0,
    sun: Sun = None,
    as_json: Json = False,
) -> None:
    """Make a scene of Gaussians trained elsewhere and a route through them."""
    sizes = {"camera_height": camera_height, "half_width": half_width, "metres_per_unit": metres_per_unit}
    show(call("scene_import", False, gaussians, route, out, sun_direction_deg=sun, **sizes), as_json)


@app.command()
def render(
    scene: Annotated[str, typer.Argument(help="Scene folder, or street.")],
    pose: Annotated[str, typer.Option(help="JSON file: viewmat 4x4, K 3x3, width, height.")],
    out: Annotated[str, typer.Option(help="Folder for rgb.png and the buffers.")],
    backend: Annotated[str, typer.Option(help="auto, cpu or gsplat.")] = "auto",
    as_json: Json = False,
) -> None:
    """Render one frame of a scene at a world-to-camera pose."""
    show(call("render_pose", False, scene, pose, out, backend=backend), as_json)
