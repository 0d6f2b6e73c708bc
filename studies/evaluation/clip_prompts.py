"""The sentences that CLIP's severity score holds pictures against."""

from pathlib import Path

from catalogs.names import WeatherName
from catalogs.quantities import CatalogueEntry, CatalogueList, Text
from studies.plans import load_plan


class Prompts(CatalogueEntry):
    """Four sentences of one weather."""

    value: tuple[Text, Text, Text, Text]
    source: Text


class PromptFile(CatalogueList[dict[WeatherName, Prompts]]):
    """Content of the file, in the order of the rows of `text_features`."""

    def build(self) -> dict[str, tuple[str, ...]]:
        """Return the sentences by kind of weather."""
        return {weather: prompts.value for weather, prompts in self.root.items()}


def load_prompts() -> dict[str, tuple[str, ...]]:
    """Return the sentences of `clip_prompts.yaml`."""
    prompts: dict[str, tuple[str, ...]] = load_plan(
        PromptFile, Path(__file__).parent, "clip_prompts", "list of prompts"
    )
    return prompts
