"""Files and maps that the tests of an import give it, and what it says of them."""

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
import yaml

from flows.measured.importing import import_measurements
from tasks.errors import InputError
from tests.campaign.recorded import MAP

Columns = dict[str, np.ndarray]


def write_map(folder: Path, **changes: object) -> str:
    content = yaml.safe_load(MAP) | changes
    (folder / "map.yaml").write_text(yaml.safe_dump(content))
    return str(folder / "map.yaml")


def map_beside(folder: Path) -> str:
    """The map in a folder of its own, where it is no recording."""
    (folder / "map").mkdir()
    return write_map(folder / "map")


def write_csv(path: Path, columns: Columns) -> str:
    pd.DataFrame(columns).to_csv(path, index=False)
    return str(path)


def problems_of(tmp_path: Path, columns: Columns, **changes: object) -> str:
    source = write_csv(tmp_path / "log.csv", columns)
    with pytest.raises(InputError) as caught:
        import_measurements(source, map=write_map(tmp_path, **changes), out=str(tmp_path / "campaign"))
    assert not (tmp_path / "campaign").exists()
    return str(caught.value)


def import_columns(tmp_path: Path, source: str, **changes: object) -> Columns:
    import_measurements(source, map=write_map(tmp_path, **changes), out=str(tmp_path / "campaign"))
    (run,) = (tmp_path / "campaign" / "runs").iterdir()
    table = pq.read_table(run)
    return {name: table.column(name).to_numpy() for name in table.column_names}
