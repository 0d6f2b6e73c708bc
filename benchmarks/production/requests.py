"""How often a run asks an object store: a server on loopback that counts, and clips of telemetry alone."""

import logging
import os
import tempfile
from collections import Counter
from pathlib import Path
from unittest.mock import patch

import yaml

from benchmarks.scale.copies import grid_of
from flows.making.generate import generate_dataset

CLIPS = 200


class _Counting(logging.Handler):
    """Counts the requests that the server logs, by their method."""

    def __init__(self) -> None:
        super().__init__()
        self.methods: Counter[str] = Counter()

    def emit(self, record: logging.LogRecord) -> None:
        for method in ("PUT", "GET", "POST", "DELETE", "HEAD"):
            if f'"{method} /' in record.getMessage():
                self.methods[method] += 1


def count_requests(clips: int = CLIPS) -> dict[str, float]:
    """Requests a clip by method [1], those of the run as a whole among them."""
    import boto3
    from moto.server import ThreadedMotoServer

    server, counting = ThreadedMotoServer(port=0), _Counting()
    log = logging.getLogger("werkzeug")
    log.setLevel(logging.INFO)
    log.addHandler(counting)
    server.start()
    host, port = server.get_host_and_port()
    address = f"http://{host}:{port}"
    with tempfile.TemporaryDirectory() as folder:
        variables = {
            "AWS_ENDPOINT_URL": address,
            "AWS_REGION": "us-east-1",
            "AWS_ACCESS_KEY_ID": "somebody",
            "AWS_SECRET_ACCESS_KEY": "secret",
        }
        grid = Path(folder) / "grid.yaml"
        grid.write_text(yaml.safe_dump(grid_of(clips), sort_keys=False))
        with patch.dict(os.environ, variables):
            boto3.client("s3").create_bucket(Bucket="data")
            counting.methods.clear()
            report = generate_dataset(
                str(grid), "s3://data/sets/counted", runner="threads", workers=1, pictures=False
            )
    server.stop()
    return {method: count / report.clips for method, count in counting.methods.items()}
