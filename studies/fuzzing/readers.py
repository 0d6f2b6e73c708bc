"""Loaders of documents that take more than one call to read: each reads a document as a user of it does."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from catalogs.entries import load
from catalogs.recordings import read_signals, summarise_signals
from catalogs.weather.grip import WeatherFolder
from catalogs.weather.look import load_weather
from flows.auditing.signing import signature_findings
from flows.auditing.verify import verify_dataset
from flows.making.scenes import scene_import
from flows.reading.describe import describe_dataset
from flows.reading.query import VIEWS, query_dataset
from flows.store.layout import Layout
from studies.physics_judge.audit_physics import clip_columns, clip_facts
from tasks.errors import InputError


def read_dataset(folder: Path) -> None:
    """Verify, describe and query a dataset, as a reader does first."""
    result = verify_dataset(str(folder))
    describe_dataset(str(folder))
    for view in VIEWS:
        query_dataset(
            str(folder),
            f"SELECT * FROM {view} ORDER BY clip_id LIMIT 5" if view != "pairs" else "SELECT * FROM pairs",
        )
    if not result["verified"]:
        raise InputError([f"{fault['path']} is {fault['damage']}" for fault in result["damaged"]])


def read_tables(folder: Path) -> None:
    """The tables of every clip as the auditors of its physics read them."""
    for facts in clip_facts(folder):
        clip_columns(folder, "ticks", facts)
        clip_columns(folder, "frames", facts)


def read_signature(folder: Path) -> None:
    """A signed dataset's signature, held against the signer's key."""
    found = signature_findings(Layout(folder), str(folder / "public.pem"))
    if not found["signed"]:
        raise InputError(found["signature"])


def read_recording(folder: Path) -> None:
    """A recording as an import reads it, and as a list of its signals."""
    channel_map, _ = load("channel map", folder / "map.yaml")
    path = next(folder.glob("log.*"))
    summarise_signals(path, channel_map)
    read_signals(path, channel_map)


def read_weather(folder: Path) -> None:
    """How the weathers look, and how they grip: what rolls on a road reads its own parts of the same files."""
    weather = WeatherFolder(folder)
    load_weather(weather)
    load("surface", "dense-asphalt", weather)
    load("vehicle", "paper-reference", weather)


def import_scene(folder: Path) -> None:
    """A file of Gaussians along a route, to the folder that is not written."""
    files = {path.name.partition(".")[0]: path for path in folder.iterdir()}
    scene_import(str(files["cloud"]), str(files["route"]), str(folder / "scene"), camera_height=1.65)


def remove_cache(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function without its cache, in which another document of the same place would be found."""
    return getattr(function, "__wrapped__", function)
