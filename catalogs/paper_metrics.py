"""The paper's own figures of its video metrics."""

from pathlib import Path

import yaml

PAPER_METRICS = Path(__file__).with_name("paper_metrics.yaml")


def paper_values() -> dict[str, float]:
    """Value by metric name; a metric without a printed value is left out."""
    entries = yaml.safe_load(PAPER_METRICS.read_text(encoding="utf-8"))
    return {name: float(entry["value"]) for name, entry in entries.items()}
