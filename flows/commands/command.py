"""One command as data: its name, the function it runs, its options, and what of the result is printed."""

from collections.abc import Callable, Mapping
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
    shown_default : what ``--help`` says of the default, where the value itself says nothing to a reader
    positional : whether it is an argument without ``--``
    spelling : keyword of the command line, where it is not that of the function
    minimum, maximum : bounds of a number
    in_store : whether the path may be an address in an object store
    known : values that the shell can complete: a list of them, or a pattern of files of the project, whose stems count
    values : what the function takes for each word of the command line, where that is no text; there is no other word
    off : word for which ``--no-`` and the option's name stands too
    """

    name: str
    kind: Any
    help: str
    default: Any = REQUIRED
    shown_default: str = ""
    positional: bool = False
    spelling: str = ""
    minimum: float | None = None
    maximum: float | None = None
    in_store: bool = False
    known: tuple[str, ...] | str = ()
    values: Mapping[str, Any] | None = None
    off: str = ""

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
    """Return a function that returns whether this value of a result is true."""
    return lambda result: bool(result[key])


DATASET = define_argument("dataset", str, "Folder or s3:// address of a finished dataset.", in_store=True)
GRID = define_argument(
    "grid", str, "Grid: YAML file, or the name of one in catalogs/grids.", known="catalogs/grids/*.yaml"
)
CAMPAIGN = define_argument("campaign", str, "Campaign folder: campaign.yaml, runs.csv, runs/*.parquet.")
TRACES = define_argument("traces", str, "Folder with cases.json and the traces as Parquet files.")
VEHICLE = define_option(
    "vehicle",
    str,
    "Vehicle: YAML file, or the name of one in catalogs/vehicles.",
    "paper-reference",
    known="catalogs/vehicles/*.yaml",
)
CAMPAIGN_VEHICLE = define_option(
    "vehicle",
    str | None,
    "Vehicle to start from: YAML file, or the name of one in catalogs/vehicles; by default the one that the"
    " campaign names.",
    None,
    known="catalogs/vehicles/*.yaml",
)
CAMERA = define_option(
    "camera",
    str,
    "Camera: YAML file with width, height, and focal_length or fx, fy, cx, cy [px].",
    known="catalogs/cameras/*.yaml",
)
OUT = define_option(
    "out",
    str | None,
    "Folder for the result as a JSON file, its figures and its page, where it has any; by default nothing is written.",
    None,
)
BACKEND = define_option(
    "backend",
    str,
    "Rasteriser: cpu, gsplat (needs a CUDA GPU), or auto, which takes gsplat where it works.",
    "auto",
    known=("auto", "cpu", "gsplat"),
)
RUNNER = (
    define_option(
        "runner",
        str,
        "Where clips are made: in threads, in processes, or by dask.",
        "dask",
        known=("threads", "processes", "dask"),
    ),
    define_option(
        "workers",
        int | None,
        "Number of clips made at once; by default the number of processors.",
        None,
        minimum=1,
    ),
    define_option(
        "scheduler",
        str | None,
        "tcp:// or tls:// address of a running Dask scheduler; by default dask runs on this machine.",
        None,
    ),
)
GENERATING_RUNNER = (
    define_option(
        "runner",
        str,
        "Where clips are made: in threads, in processes, or by dask; auto takes dask with frames, and threads without.",
        "auto",
        known=("auto", "threads", "processes", "dask"),
    ),
    *RUNNER[1:],
)
