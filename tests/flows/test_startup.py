"""What starts often imports little: a verdict nothing that draws, a worker nothing but what makes clips."""

import subprocess
import sys

HEAVY = (
    "av", "cv2", "cyclonedx", "dask", "duckdb", "matplotlib", "pandas", "plotly", "prefect", "rich",
    "scipy.interpolate", "scipy.ndimage", "scipy.signal", "scipy.stats", "torch", "zarr",
)  # fmt: skip


def test_a_verdict_and_then_a_worker_import_no_library_that_their_start_does_not_need():
    code = (
        "import sys\n"
        "for module in ('flows.measured.closing', 'flows.making.clip'):\n"
        f"    __import__(module); print(*sorted({{*{HEAVY!r}}} & sys.modules.keys()))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    verdict, worker, _ = done.stdout.split("\n")
    assert (verdict, worker) == ("", "cv2 scipy.interpolate scipy.ndimage zarr")
