"""The sentences that CLIP's severity score holds pictures against."""

from pathlib import Path

from catalogs.quantities import CatalogueEntry, Text, read_entry

CLIP_PROMPTS = Path(__file__).with_name("clip_prompts.yaml")


class Prompts(CatalogueEntry):
    """Four sentences of one weather."""

    value: tuple[Text, Text, Text, Text]
    source: Text


class PromptFile(CatalogueEntry):
    """Content of the file, in the order of the rows of `text_features`."""

    dry: Prompts
    rain: Prompts
    snow: Prompts


def load_prompts() -> dict[str, tuple[str, ...]]:
    """Sentences by weather, in the order of the rows of `text_features`: dry, rain, snow."""
    file = read_entry(PromptFile, CLIP_PROMPTS, "list of prompts")
    return {weather: getattr(file, weather).value for weather in PromptFile.model_fields}
