"""One command as data: its name, the function it runs, its options, and what of the result is printed."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

Result = dict[str, Any]
REQUIRED: Any = object()
"""Default of a required option."""


@dataclass(frozen=True, kw_only=True)
class Option:
    """An option of a command.

    Parameters
    ----------
    name : keyword of the function that takes the value; the command line writes ``--name`` with hyphens
    kind : type of the value
    help : sentence of ``--help``
    default : value where the option is not given
    positional : whether it is an argument without ``--``
    spelling : keyword of the command line, where it is not that of the function
    minimum, maximum : bounds of a number
    in_store : whether the path may be an address in an object store
    known : values that the shell can complete: a list of them, or a pattern of files of the project, whose stems count
    """

    name: str
    kind: Any
    help: str
    default: Any = REQUIRED
    positional: bool = False
    spelling: str = ""
    minimum: float | None = None
    maximum: float | None = None
    in_store: bool = False
    known: tuple[str, ...] | str = ()

    @property
    def keyword(self) -> str:
        """Keyword of the command line."""
        return self.spelling or self.name


def define_argument(name: str, kind: Any, text: str, default: Any = REQUIRED, **details: Any) -> Option:
    """Return an argument of the command line, which is given by its position.

    Parameters
    ----------
    name, kind, text, default : as of `Option`, whose ``help`` is ``text``
    details : further fields of `Option`
    """
    return Option(name=name, kind=kind, help=text, default=default, positional=True, **details)


def define_option(name: str, kind: Any, text: str, default: Any = REQUIRED, **details: Any) -> Option:
    """Return an option of the command line.

    Parameters
    ----------
    name, kind, text, default : as of `Option`, whose ``help`` is ``text``
    details : further fields of `Option`
    """
    return Option(name=name, kind=kind, help=text, default=default, **details)


def show_all(result: Result) -> Result:
    """Return the whole result."""
    return result


def pass_always(_: Result) -> bool:
    """Return True: the command checks nothing."""
    return True


@dataclass(frozen=True, kw_only=True)
class Command:
    """A command of ``musync``.

    Parameters
    ----------
    name : words after ``musync``
    group : heading of ``musync --help`` below which it stands
    sentence : what it does, for ``--help``
    function : ``module:function`` that it runs, and that the Prefect flow of the same name runs
    options : in the order of ``--help``
    brief : what is printed of the result without ``--json``
    passed : whether the result passes the check that the command makes; if not, its exit code is 1
    output : ``table`` prints values and tables, ``sentences`` what ``format_text`` of the function's module says,
        ``nothing`` nothing
    json_with : option with which the result is always printed as JSON
    is_flow : whether there is a Prefect flow of it, and the option ``--prefect``
    one_thread : whether linear algebra is kept to one thread
    """

    name: str
    group: str
    sentence: str
    function: str
    options: tuple[Option, ...]
    brief: Callable[[Result], Result] = show_all
    passed: Callable[[Result], bool] = pass_always
    output: Literal["table", "sentences", "nothing"] = "table"
    json_with: str = ""
    is_flow: bool = True
    one_thread: bool = False


def select_keys(*keys: str) -> Callable[[Result], Result]:
    """Return a function that keeps these keys of a result."""
    return lambda result: {key: result[key] for key in keys}


def require_key(key: str) -> Callable[[Result], bool]:
    """Return a function that tells whether this value of a result is true."""
    return lambda result: bool(result[key])


DATASET = define_argument("dataset", str, "Folder or s3:// address of a finished dataset.", in_store=True)
GRID = define_argument(
    "grid", str, "Grid file, or the name of a grid that ships.", known="catalogs/grids/*.yaml"
)
CAMPAIGN = define_argument("campaign", str, "Campaign folder: campaign.yaml, runs.csv, runs/*.parquet.")
TRACES = define_argument("traces", str, "Folder with cases.json and the traces as Parquet files.")
VEHICLE = define_option(
    "vehicle", str, "Vehicle name or file.", "paper-reference", known="catalogs/vehicles/*.yaml"
)
CAMPAIGN_VEHICLE = define_option(
    "vehicle",
    str | None,
    "Vehicle name or file to start from; by default the campaign's.",
    None,
    known="catalogs/vehicles/*.yaml",
)
CAMERA = define_option(
    "camera",
    str,
    "Camera YAML: a catalogue entry, or fx, fy, cx, cy.",
    known="catalogs/cameras/*.yaml",
)
OUT = define_option("out", str | None, "Folder for the JSON file that this command writes.", None)
BACKEND = define_option(
    "backend", str, "Rasteriser: auto, cpu or gsplat.", "auto", known=("auto", "cpu", "gsplat")
)
RUNNER = (
    define_option(
        "runner", str, "threads, processes or dask.", "dask", known=("threads", "processes", "dask")
    ),
    define_option(
        "workers", int | None, "Clips made at once; by default one for each processor.", None, minimum=1
    ),
    define_option("scheduler", str | None, "tcp:// or tls:// address of a running Dask scheduler.", None),
)
GENERATING_RUNNER = (
    define_option(
        "runner",
        str,
        "auto, threads, processes or dask; auto takes dask for frames, and threads without them.",
        "auto",
        known=("auto", "threads", "processes", "dask"),
    ),
    *RUNNER[1:],
)
