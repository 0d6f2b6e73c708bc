"""Metrics of a schedule's run as Prometheus text, for the node exporter's textfile collector."""

from collections.abc import Mapping
from datetime import datetime
from typing import Any

from prometheus_client import CollectorRegistry, Gauge, generate_latest

GAUGES = {
    "to_make": ("musync_run_clips", "clips that the run has to make"),
    "made": ("musync_run_clips_done", "clips that the run has made"),
    "failed": ("musync_run_clips_failed", "clips that could not be made"),
    "quarantined": (
        "musync_dataset_clips_quarantined",
        "clips whose pose check failed, of the finished dataset",
    ),
    "cpu_s": ("musync_run_cpu_seconds", "processor time of the run"),
    "bytes": ("musync_dataset_bytes", "size of the finished dataset"),
    "scheduled": ("musync_run_scheduled_timestamp_seconds", "when the run was due"),
    "began": ("musync_run_began_timestamp_seconds", "when the run began"),
    "updated": ("musync_run_updated_timestamp_seconds", "when the run last made a sign"),
    "ended": ("musync_run_ended_timestamp_seconds", "when the run ended; absent while it goes on"),
}
"""Name and help of each metric by key of the record; one that is not known is absent."""
SUCCEEDED = (
    "musync_run_succeeded",
    "1 for a run that made its dataset, 0 for one that failed; absent before",
)


def format_metrics(record: Mapping[str, Any]) -> bytes:
    """The text of a run's metrics, labelled with the grid's name.

    Parameters
    ----------
    record : fields of `flows.scheduled.run_record.RunRecord`
    """
    registry = CollectorRegistry()
    known = {spec: _number_of(record[key]) for key, spec in GAUGES.items() if record[key] is not None}
    if record["ended"] is not None:
        known[SUCCEEDED] = float(record["error"] is None)
    for (name, text), value in known.items():
        Gauge(name, text, ["grid"], registry=registry).labels(record["grid"]).set(value)
    return generate_latest(registry)


def _number_of(value: Any) -> float:
    if isinstance(value, list):
        return float(len(value))
    return datetime.fromisoformat(value).timestamp() if isinstance(value, str) else float(value)
