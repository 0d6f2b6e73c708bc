"""Processes that start often import little: a verdict nothing that draws, a worker only what makes clips."""

import subprocess
import sys

import pyarrow as pa
import pyarrow.parquet as pq

HEAVY = (
    "av", "cv2", "cyclonedx", "dask", "duckdb", "matplotlib", "pandas", "plotly", "prefect", "rich",
    "scipy.interpolate", "scipy.ndimage", "scipy.signal", "scipy.stats", "torch", "zarr",
)  # fmt: skip


def test_a_verdict_that_has_read_a_run_and_then_a_worker_import_no_library_that_they_do_not_need(tmp_path):
    run = tmp_path / "run.parquet"
    pq.write_table(pa.table({"speed": [1.0, 2.0]}), run)
    code = (
        "import sys; from pathlib import Path; import flows.measured.closing, catalogs.campaign_files as files\n"
        "files.parse_columns(Path(sys.argv[1]).read_bytes(), 'run', ['speed'])\n"
        f"print(*sorted({{*{HEAVY!r}}} & sys.modules.keys()))\n"
        f"import flows.making.clip; print(*sorted({{*{HEAVY!r}}} & sys.modules.keys()))"
    )
    done = subprocess.run([sys.executable, "-c", code, run], capture_output=True, text=True, check=True)
    verdict, worker, _ = done.stdout.split("\n")
    assert (verdict, worker) == ("", "cv2 scipy.interpolate scipy.ndimage zarr")
