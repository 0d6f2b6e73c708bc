"""Campaigns read as drives: any channels, and every fault of the folder in a sentence."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from studies.measured_drives.drives import read_drives
from tasks.errors import InputError

HEADER = {"campaign": "toy", "vehicle": "paper-reference", "sample_rate_hz": 50}
ROW = {"run": "a", "weather": "rain", "precipitation_mm_h": 10.0, "snow_accumulation_h": 0.0, "drive": "one"}
COLUMNS = {
    name: np.arange(10.0) for name in ("brake_pressure", "speed", "pitch", "longitudinal_acceleration")
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "runs").mkdir()
    (tmp_path / "campaign.yaml").write_text(yaml.safe_dump(HEADER))
    pd.DataFrame([ROW, ROW | {"run": "b", "drive": ""}]).to_csv(tmp_path / "runs.csv", index=False)
    for name in "ab":
        pd.DataFrame(COLUMNS | {"odd": np.zeros(10)}).to_parquet(tmp_path / "runs" / f"{name}.parquet")
    return tmp_path


def problems_of(folder: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_drives(folder)
    return str(caught.value)


def test_runs_come_with_their_drive_weather_and_known_channels(folder: Path) -> None:
    campaign = read_drives(folder)
    first, second = campaign.drives
    assert (first.drive, second.drive, first.interval) == ("one", "b", 0.02)
    assert (first.weather.kind, first.weather.precipitation_mm_h) == ("rain", 10.0)
    assert set(first.columns) == set(COLUMNS)


def test_missing_files_and_channels_and_gaps_are_all_listed(folder: Path) -> None:
    (folder / "runs" / "a.parquet").unlink()
    holed = COLUMNS | {"speed": np.where(np.arange(10) == 3, np.nan, 1.0)}
    del holed["pitch"]
    pd.DataFrame(holed).to_parquet(folder / "runs" / "b.parquet")
    text = problems_of(folder)
    assert (
        "a: runs.csv names it" in text
        and "b: channel pitch is missing" in text
        and "b: channel speed has a gap" in text
    )
    (folder / "runs.csv").unlink()
    assert "needs runs.csv" in problems_of(folder)
