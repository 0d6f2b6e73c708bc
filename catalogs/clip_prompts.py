"""The sentences that CLIP's severity score holds pictures against."""

from pathlib import Path

from pydantic import TypeAdapter

from catalogs.names import WeatherName
from catalogs.quantities import CatalogueEntry, Text, read_entries

CLIP_PROMPTS = Path(__file__).with_name("clip_prompts.yaml")


class Prompts(CatalogueEntry):
    """Four sentences of one weather."""

    value: tuple[Text, Text, Text, Text]
    source: Text


PROMPT_FILE = TypeAdapter(dict[WeatherName, Prompts])
"""Content of the file, in the order of the rows of `text_features`."""


def load_prompts() -> dict[str, tuple[str, ...]]:
    """Sentences by kind of weather, in the order of the rows of `text_features`."""
    file = read_entries(PROMPT_FILE, CLIP_PROMPTS, "list of prompts")
    return {weather: prompts.value for weather, prompts in file.items()}
