"""Pages of the Python reference: the modules that an engineer looks up, by subject; mkdocstrings fills them in."""

from functools import partial

PAGES: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "musync": (
        "musync: open a dataset, step a car",
        "`import musync` opens a finished dataset ([query a dataset](../../how-to/query-a-dataset.md)) and drives a car"
        " [step by step](../../how-to/drive-the-car-in-another-simulator.md#step-by-step-in-python).",
        (
            "flows.reading.opening.open",
            "flows.reading.opening.Dataset",
            "flows.reading.clips.Clip",
            "flows.reading.windows.ClipWindows",
            "flows.reading.windows.SeededOrder",
            "flows.driving.simulator.Simulator",
            "flows.driving.simulator.Observation",
            "tasks.errors.InputError",
        ),
    ),
    "surface": (
        "Surface: weather, film, snow, friction",
        "From a precipitation rate to what lies on the road and how it grips.",
        ("tasks.surface.weather", "tasks.surface.state", "tasks.surface.road_profile"),
    ),
    "vehicle": (
        "Vehicle: parameters, rollout, model",
        "From brake pressure and road to motion. [Two modes](../../explanation/vehicle-modes.md) says how they differ.",
        (
            "tasks.vehicle.parameters",
            "tasks.vehicle.rollout",
            "tasks.vehicle.brake",
            "tasks.vehicle.half_car",
            "tasks.vehicle.figures",
            "tasks.vehicle.model.simulation",
            "tasks.vehicle.model.brake_input",
            "tasks.vehicle.model.ports",
            "tasks.vehicle.model.axle_ports",
            "tasks.vehicle.model.vertical_ports",
            "tasks.vehicle.paper.paper_mode",
            "tasks.vehicle.paper.wheels",
            "tasks.vehicle.paper.low_speed",
        ),
    ),
    "tyres-and-effects": (
        "Tyres and effects",
        "Laws of the tyre, and what may be added to the model. [Tyres](../tyres.md) and"
        " [the table of effects](../effects.md) have the numbers.",
        (
            "tasks.vehicle.tyres.contract",
            "tasks.vehicle.tyres.burckhardt",
            "tasks.vehicle.tyres.magic_formula",
            "tasks.vehicle.effects.table",
            "tasks.vehicle.effects.equations",
            "tasks.vehicle.effects.chassis",
            "tasks.vehicle.effects.lateral_force",
            "tasks.vehicle.effects.brake_line",
            "tasks.vehicle.effects.forms",
            "tasks.vehicle.effects.grown",
        ),
    ),
    "scene-and-camera": (
        "Scene, camera, labels",
        "The street, the camera's pose under heave and pitch, and the ground truth of a frame.",
        (
            "tasks.scene.scene",
            "tasks.scene.gaussians",
            "tasks.scene.route",
            "tasks.render.camera",
            "tasks.render.composition",
            "tasks.render.labels",
            "tasks.reconstruction.sequence",
            "tasks.reconstruction.reconstruct",
        ),
    ),
    "judges": (
        "Judges",
        "What is measured from finished frames and stored telemetry. [Judges](../../explanation/judges.md) says why"
        " they share no code with what they judge.",
        (
            "tasks.eval.poses.checks",
            "tasks.eval.poses.motion",
            "tasks.eval.poses.photometric",
            "tasks.eval.poses.pnp",
            "tasks.eval.poses.essential",
            "tasks.eval.state_agreement",
            "tasks.eval.motion_agreement",
            "tasks.eval.body_agreement",
            "studies.evaluation.metrics.video_motion",
            "studies.evaluation.metrics.road_edit",
            "studies.evaluation.metrics.severity",
            "tasks.eval.image_quality",
            "studies.physics_judge.laws.law",
        ),
    ),
    "measured-runs": (
        "Measured runs and verdicts",
        "Campaigns, and how `close-loop` reaches a verdict: [rules of a verdict](../verdict-rules.md).",
        (
            "tasks.campaign.campaign",
            "tasks.campaign.channels",
            "tasks.campaign.signals",
            "tasks.identification.rules",
            "tasks.identification.inference.hypothesis",
            "tasks.identification.inference.forward",
            "tasks.identification.decision.verdict",
            "tasks.identification.decision.answer",
            "tasks.identification.decision.held_out",
        ),
    ),
    "conventions": (
        "Conventions",
        "Axes, classes and columns: the one table from which files are labelled.",
        ("tasks.conventions",),
    ),
}
"""Title, introduction and objects of each page, by the name of its file."""


def write_module_page(title: str, introduction: str, objects: tuple[str, ...]) -> str:
    """Return a page of the Python reference as Markdown.

    Parameters
    ----------
    title, introduction : how it begins
    objects : modules, classes and functions, which mkdocstrings describes
    """
    parts = [f"# {title}\n\n{introduction}\n"]
    for path in objects:
        name = path.rsplit(".", 1)[-1]
        offered = path.startswith(("flows.reading", "flows.driving")) or name == "InputError"
        public = f"musync.{name}" if offered else path
        parts.append(f"\n## `{public}`\n\n::: {path}\n")
    return "".join(parts)


WRITERS = {f"reference/python/{name}.md": partial(write_module_page, *page) for name, page in PAGES.items()}
"""Function that writes each page, by its path below ``docs/``."""
