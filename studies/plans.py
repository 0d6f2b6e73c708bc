"""Plans of studies: YAML files beside the study that reads them."""

from pathlib import Path
from typing import Any

from catalogs.documents import LARGEST_YAML, read_content
from catalogs.quantities import CatalogueEntry, CatalogueList, parse_entry


def load_plan(
    form: type[CatalogueEntry | CatalogueList[Any]], folder: Path, name_or_path: str | Path, kind: str
) -> Any:
    """Return what a plan builds, by the name of a file in the study's folder or by its own file.

    Parameters
    ----------
    form : what the file must hold
    folder : of the study
    name_or_path : of the plan
    kind : what it is called in the sentences

    Raises
    ------
    InputError
        Listing every problem of the file.
    """
    path = Path(name_or_path)
    if path.suffix != ".yaml":
        path = folder / f"{name_or_path}.yaml"
    return parse_entry(form, read_content(path, kind, LARGEST_YAML), path, kind).build()
