"""Commands that make datasets and look into them."""

from math import degrees
from typing import Any

from flows.commands.command import (
    BACKEND,
    DATASET,
    GENERATING_RUNNER,
    GRID,
    RUNNER,
    Command,
    define_argument,
    define_option,
)
from flows.exporting.formats import FORMAT_NAMES

GROUP = "Datasets"
CLIPS = define_option(
    "clips",
    list[str] | None,
    "Label or id of a clip, by default every clip; may be given more than once.",
    None,
    spelling="clip",
)
VEHICLE = define_option(
    "vehicle",
    str | None,
    "Vehicle to take instead of the grid's: YAML file, or the name of one in catalogs/vehicles.",
    None,
    known="catalogs/vehicles/*.yaml",
)
FRAMES = {"stored": True, "later": "later", "none": False}
PICTURES = define_option(
    "pictures",
    str,
    "Store the frames, make them later, when they are read, or none; --no-frames is short for none.",
    True,
    shown_default="stored",
    spelling="frames",
    known=tuple(FRAMES),
    values=FRAMES,
    off="none",
)


def list_quarantined_clips(result: dict[str, Any]) -> dict[str, Any]:
    """Return the result of a run with a table row for each clip in quarantine."""
    rows = result["quarantined"].items()
    listed = [{"clip": label, "why": "; ".join(reasons)} for label, reasons in rows]
    return result | ({"quarantined": listed} if listed else {})


def shorten_description(result: dict[str, Any]) -> dict[str, Any]:
    """Return a dataset's description with the columns of its clips that fit a terminal, units in their names."""
    clips = [
        {
            "clip": row["label"],
            "friction": row["surface_friction"],
            "stop_m": row["stopping_distance"],
            "peak_pitch_deg": None if row["peak_pitch"] is None else degrees(row["peak_pitch"]),
            "passed": row["passed"],
        }
        for row in result["clips"]
    ]
    return result | {"clips": clips}


MOST_ROWS = 100
"""Rows of an answer that are printed [1]; of a longer one, the first and the last `SHOWN_ROWS`."""
SHOWN_ROWS = 20


def select_answer(result: dict[str, Any]) -> dict[str, Any]:
    """Return the rows of an answer, of a long one its ends, or the file that holds them and how many they are."""
    chosen: dict[str, Any] = {key: result[key] for key in ("file", "row_count", "rows") if key in result}
    count = len(chosen.get("rows", ()))
    if count <= MOST_ROWS:
        return chosen
    gap = dict.fromkeys(result["columns"], "...")
    return {
        "rows": [*chosen["rows"][:SHOWN_ROWS], gap, *chosen["rows"][-SHOWN_ROWS:]],
        "left out": f"{count - 2 * SHOWN_ROWS:,} of {count:,} rows; --to csv --out FILE writes all of them",
    }


COMMANDS = (
    Command(
        name="generate",
        group=GROUP,
        sentence="Make the dataset of a scenario grid, or the clips that it still lacks.",
        function="flows.making.request:make_dataset",
        options=(
            define_argument("grid", str | None, GRID.help, None, known=GRID.known),
            define_option(
                "out",
                str,
                "Dataset folder: new, empty, or an unfinished run of the same grid.",
                in_store=True,
            ),
            define_option(
                "manifest",
                str | None,
                "Make this frozen run again instead of a grid: JSON file, or the name of one in manifests/frozen.",
                None,
                known="manifests/frozen/*.json",
            ),
            *GENERATING_RUNNER,
            BACKEND,
            VEHICLE,
            define_option(
                "poses",
                str | None,
                "Folder of reference traces (cases.json, Parquet files): each clip shows the motion of the one with"
                " its conditions, not the vehicle's.",
                None,
            ),
            PICTURES,
        ),
        brief=list_quarantined_clips,
        passed=lambda result: not result.get("telemetry_differs"),
    ),
    Command(
        name="materialise",
        group=GROUP,
        sentence="Make frames that were left for later, of all clips or some, so that no reader waits for them.",
        function="flows.reading.materialise:materialise_frames",
        options=(DATASET, CLIPS, *RUNNER[:2]),
        brief=list_quarantined_clips,
    ),
    Command(
        name="drive",
        group=GROUP,
        sentence="Make the dataset of a grid whose clips a policy brakes: a function that is asked step by step.",
        function="flows.driving.drive:drive_grid",
        options=(
            GRID,
            define_option(
                "policy",
                str,
                "module:function of the observation that returns the pressure [MPa]; of a class each drive gets an"
                " object. Its source and hash are kept.",
            ),
            define_option(
                "out",
                str,
                "Dataset folder: new, empty, or an unfinished run of the same drive.",
                in_store=True,
            ),
            define_option(
                "rate_hz", float, "How often the policy is asked, whole milliseconds apart [Hz].", 20.0
            ),
            *GENERATING_RUNNER,
            BACKEND,
            PICTURES,
        ),
        brief=list_quarantined_clips,
    ),
    Command(
        name="lab freeze",
        group=GROUP,
        sentence="Freeze a run for generate --manifest: scenarios, seeds, parameters and the hash of each clip's"
        " telemetry.",
        function="flows.making.freezing:freeze_run",
        options=(
            define_argument(
                "grid",
                str | None,
                "Grid: YAML file, or the name of one in catalogs/grids; by default those of every run in"
                " manifests/frozen.",
                None,
                known=GRID.known,
            ),
            define_option(
                "out", str | None, "JSON file to write; by default manifests/frozen/NAME.json.", None
            ),
        ),
    ),
    Command(
        name="schedule",
        group=GROUP,
        sentence="Make a dataset of a grid at set times, as a Prefect deployment served from this process.",
        function="flows.scheduled.scheduling:serve_grid",
        options=(
            GRID,
            define_option("every", str, 'Cron expression, UTC: "0 3 * * *" is every night at three.'),
            define_option(
                "out",
                str,
                "Folder or s3:// address in which each run makes its dated dataset.",
                in_store=True,
            ),
            *RUNNER,
            define_option(
                "notify",
                str | None,
                "Who is notified of runs: a command, an http(s) address, an Apprise address (mailto://, slack://, ...),"
                " or env:NAME of a variable that holds one.",
                None,
            ),
            define_option(
                "notify_on",
                str,
                "Ends of a run of which a notice is sent, with commas between: failed, late, done.",
                "failed,late",
            ),
            define_option(
                "keep",
                int | None,
                "Remove this schedule's oldest finished datasets beyond this number; by default all stay.",
                None,
                minimum=1,
            ),
        ),
        output="nothing",
        is_flow=False,
    ),
    Command(
        name="status",
        group=GROUP,
        sentence="Say what runs in a dataset or a schedule's folder, how far it is, how long yet, and what failed.",
        function="flows.scheduled.status:report_status",
        options=(
            define_argument(
                "out", str, "Dataset, or folder of a schedule; a folder or s3:// address.", in_store=True
            ),
        ),
        output="sentences",
        is_flow=False,
    ),
    Command(
        name="validate",
        group=GROUP,
        sentence="Check a grid and estimate its size, without making anything.",
        function="flows.reading.describe:validate_grid",
        options=(GRID, VEHICLE, PICTURES),
    ),
    Command(
        name="lab describe",
        group=GROUP,
        sentence="Summarise a dataset: clips, weathers, road features, verdicts.",
        function="flows.reading.describe:describe_dataset",
        options=(DATASET,),
        brief=shorten_description,
    ),
    Command(
        name="sql",
        group=GROUP,
        sentence="Answer an SQL query over a dataset's views.",
        function="flows.reading.query:query_dataset",
        options=(
            DATASET,
            define_argument("query", str, "DuckDB SQL over clips, ticks, frames, verdicts and pairs."),
            define_option(
                "allow_files",
                bool,
                "Let the query read and write files of this machine and load extensions; without it, the query"
                " reads the dataset alone.",
                False,
            ),
            define_option(
                "to",
                str | None,
                "Write the answer to the file of --out as csv or parquet, and print where.",
                None,
                known=("csv", "parquet"),
            ),
            define_option(
                "out",
                str | None,
                "File that --to writes; an existing file is replaced only where musync sql wrote it.",
                None,
            ),
        ),
        brief=select_answer,
    ),
    Command(
        name="lab schema",
        group=GROUP,
        sentence="List every column of every view: unit, paper symbol, CF standard name and meaning.",
        function="flows.reading.query:list_columns",
        options=(
            define_option("grid", bool, "Print the JSON Schema of a grid file instead, for editors.", False),
        ),
        json_with="grid",
    ),
    Command(
        name="lab preview",
        group=GROUP,
        sentence="Make an MP4 film of each clip, with speed, slip, pitch, load and brake pressure below the picture.",
        function="flows.reading.previews:make_films",
        options=(
            DATASET,
            define_option("out", str, "Folder for the films."),
            CLIPS,
            define_option("traces", bool, "Draw the vehicle's traces below the picture.", True),
        ),
    ),
    Command(
        name="report",
        group=GROUP,
        sentence="Make a page that opens without a server: clips to filter, films beside traces, pairs of"
        " clips that differ in one input, the manifest.",
        function="flows.reading.report:make_report",
        options=(
            DATASET,
            define_option(
                "out", str | None, "Folder for the page; by default DIR-report, beside the dataset.", None
            ),
            CLIPS,
        ),
    ),
    Command(
        name="export",
        group=GROUP,
        sentence="Write a dataset in a format that other tools read, such as WebDataset, MCAP or LeRobot.",
        function="flows.exporting.export:export_dataset",
        options=(
            DATASET,
            define_option("to", str, f"{', '.join(FORMAT_NAMES)}.", known=FORMAT_NAMES),
            define_option(
                "out",
                str | None,
                "New or empty folder for the files; by default DIR-FORMAT, beside the dataset.",
                None,
            ),
            define_option(
                "clips",
                list[str] | None,
                "Label or id of a clip, by default every clip that is not in quarantine; may be given more than once.",
                None,
                spelling="clip",
            ),
        ),
    ),
)
